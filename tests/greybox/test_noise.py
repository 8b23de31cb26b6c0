"""Coloured noise: its coefficients, its order, its likelihood."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from scipy.stats import binom

from .parts import chosen_noise_order, estimated_noise, log_likelihood, noise_of, white_noise, whitened
from .plants import coloured

SHAPE = (10, 2000)
EVERYWHERE = np.ones(SHAPE, dtype=bool)
AR2 = (1.2, -0.5)  # poles 0.6 +- 0.37i


def test_the_coefficient_of_first_order_noise_is_found():
    e, w = coloured(np.random.default_rng(0), SHAPE, (0.8,), deviation=3.0)
    polynomials, deviations = estimated_noise(e[:, :, None], EVERYWHERE, 1)
    # Box, Jenkins, Reinsel, ch. 7: variance (1 - phi^2) / N; four standard errors.
    assert polynomials[0] == pytest.approx([1.0, -0.8], abs=4 * np.sqrt((1 - 0.8**2) / w.size))
    assert deviations[0] == pytest.approx(3.0, rel=4 / np.sqrt(2 * w.size))


def test_the_coefficients_of_second_order_noise_are_found_for_each_output():
    rng = np.random.default_rng(1)
    e = np.stack([coloured(rng, SHAPE, AR2)[0], coloured(rng, SHAPE, (), 0.2)[0]], axis=2)
    polynomials, deviations = estimated_noise(e, EVERYWHERE, 2)
    bound = 4 * np.sqrt((1 - AR2[1] ** 2) / EVERYWHERE.size)  # of both coefficients
    np.testing.assert_allclose(polynomials[0], [1.0, -1.2, 0.5], atol=bound)
    np.testing.assert_allclose(polynomials[1], [1.0, 0.0, 0.0], atol=4 / np.sqrt(EVERYWHERE.size))
    np.testing.assert_allclose(deviations, [1.0, 0.2], rtol=4 / np.sqrt(2 * EVERYWHERE.size))


def test_noise_that_a_plant_integrates_keeps_its_size_though_records_end_far_from_zero():
    e = np.cumsum(np.cumsum(np.random.default_rng(4).standard_normal((10, 500)), axis=1), axis=1)
    polynomials, deviations = estimated_noise(e[:, :, None], np.ones(e.shape, dtype=bool), 2)
    np.testing.assert_allclose(polynomials[0], [1.0, -2.0, 1.0], atol=1e-2)
    assert deviations[0] == pytest.approx(1.0, rel=4 / np.sqrt(2 * e.size))


def test_whitened_noise_is_the_white_noise_that_it_was_made_of_with_unit_variance():
    e, w = coloured(np.random.default_rng(2), (3, 400), AR2, deviation=0.7)
    white = whitened(noise_of([[1.0, -1.2, 0.5]], [0.7]), e[:, :, None])
    np.testing.assert_allclose(white[:, 2:, 0], w[:, 2:] / 0.7, atol=1e-9)
    assert not white[:, :2].any()  # nothing is known of what was before the record


def test_noise_without_memory_only_scales_each_output():
    e = np.random.default_rng(3).standard_normal((2, 50, 2))
    np.testing.assert_allclose(whitened(white_noise(0.5, 4.0), e), e / [0.5, 4.0])


@pytest.mark.parametrize(("coefficients", "order"), [((), 0), ((0.6,), 1), (AR2, 2)])
def test_schwarz_chooses_the_memory_that_the_noise_has(coefficients, order):
    runs = [coloured(np.random.default_rng(seed), (2, 800), coefficients)[0] for seed in range(40)]
    chosen = np.array([chosen_noise_order(e[:, :, None]) for e in runs])
    # A needless coefficient passes with P(chi2 > log 1600) = 0.7 %, so one of the up to three with less than 2 %.
    assert np.sum(chosen != order) <= binom.ppf(1 - 1e-4, len(runs), 0.02)


def with_correlation(r):
    """One record of white noise, to which as much of its past is added as makes its sample correlation r."""
    w = np.random.default_rng(6).standard_normal(2000)

    def mixed(share):
        x = w.copy()
        x[1:] += share * w[:-1]
        return x

    def off(share):
        x = mixed(share)
        return x[1:] @ x[:-1] / (x @ x) - r

    x = mixed(brentq(off, -0.5, 0.5))
    return (x / np.sqrt(np.mean(x * x)))[None, :, None]


@pytest.mark.parametrize(("gain", "order"), [(3.2, 0), (4.4, 1)])
def test_a_coefficient_costs_half_the_log_of_the_samples(gain, order):
    # Of first order, half of N times -log(1 - r^2) is gained; the price is log(2000) / 2 = 3.8.
    assert chosen_noise_order(with_correlation(np.sqrt(-np.expm1(-2 * gain / 2000)))) == order


@pytest.mark.parametrize("unit", [1e-3, 1e3])
def test_the_memory_of_noise_does_not_depend_on_the_unit(unit):
    rng = np.random.default_rng(7)
    white, first = coloured(rng, (12, 100))[0], coloured(rng, (12, 100), (0.3,))[0]
    assert [chosen_noise_order(unit * e[:, :, None]) for e in (white, first)] == [0, 1]


def test_the_log_likelihood_is_that_of_gauss_at_its_best_variance():
    # -N/2 log s^2, of each output by itself, up to the constant -N/2 (1 + log 2 pi).
    e = np.random.default_rng(4).standard_normal((3, 70, 2)) * [2.0, 0.1]
    mask = np.ones((3, 70), dtype=bool)
    expected = -0.5 * 210 * np.log(np.mean(e**2, axis=(0, 1))).sum()
    assert log_likelihood(e, mask, 0) == pytest.approx(expected, rel=1e-9)


def test_coloured_noise_is_more_likely_coloured_by_the_variance_that_its_past_explains():
    e, _ = coloured(np.random.default_rng(5), SHAPE, (0.8,))
    gain = log_likelihood(e[:, :, None], EVERYWHERE, 1) - log_likelihood(e[:, :, None], EVERYWHERE, 0)
    assert gain == pytest.approx(-0.5 * e.size * np.log(1 - 0.8**2), rel=0.05)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(order=st.integers(0, 2), length=st.integers(30, 59), garbage=st.floats(-1e6, 1e6))
def test_what_was_not_measured_does_not_count(order, length, garbage):
    e, _ = coloured(np.random.default_rng(8), (2, 60), (0.5,))
    mask = np.ones((2, 60), dtype=bool)
    mask[1, length:] = False  # the shorter record is padded
    first, second = (np.where(mask, e, filler)[:, :, None] for filler in (0.0, garbage))
    assert log_likelihood(first, mask, order) == log_likelihood(second, mask, order)
    for one, other in zip(estimated_noise(first, mask, order), estimated_noise(second, mask, order), strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_hole_in_white_noise_is_no_evidence_of_anything():
    e = np.random.default_rng(9).standard_normal((1, 3000, 1))
    mask = np.random.default_rng(10).random((1, 3000)) > 0.3
    whole = -0.5 * mask.sum() * np.log(np.mean(e[mask] ** 2))
    assert log_likelihood(e * mask[:, :, None], mask, 0) == pytest.approx(whole)
    polynomials, deviations = estimated_noise(e * mask[:, :, None], mask, 1)
    assert polynomials[0, 1] == pytest.approx(0.0, abs=4 / np.sqrt(mask.sum()))
    assert deviations[0] == pytest.approx(1.0, rel=4 / np.sqrt(2 * mask.sum()))


def test_errors_that_are_no_numbers_are_impossible():
    e = np.full((1, 20, 1), np.inf)
    with np.errstate(invalid="ignore"):
        assert log_likelihood(e, np.ones((1, 20), dtype=bool), 0) == -np.inf
