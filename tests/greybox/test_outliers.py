"""Single readings that are off: seen in the errors, told from a model that is wrong for a while, left out."""

import numpy as np
import pytest

from simgap.data.simulated.field import hide
from simgap.diagnosis.diagnose import diagnose

from .building import plain_errors, plain_search
from .parts import experiments, measured_without_outliers, outliers_flagged, outliers_found
from .plants import free_run, steps, velocity

SHAPE = (3, 400)
EVERYWHERE = np.ones(SHAPE, dtype=bool)


def errors(rate=0.02, size=20.0, seed=0, deviation=1.0):
    """White errors [E, T, 1], and where [E, T, 1] they are off by `size`: in one of ten neighbours at most."""
    rng = np.random.default_rng(seed)
    e = deviation * rng.standard_normal((*SHAPE, 1))
    off = np.zeros(SHAPE, dtype=bool).reshape(-1, 10)
    off[np.arange(len(off)), rng.integers(2, 8, len(off))] = rng.random(len(off)) < 10 * rate
    off = off.reshape(e.shape)
    return e + size * deviation * off * rng.choice([-1.0, 1.0], e.shape), off


@pytest.mark.parametrize("deviation", [1e-6, 1.0, 1e6])
def test_readings_that_are_off_are_flagged_and_no_others(deviation):
    e, off = errors(deviation=deviation)
    np.testing.assert_array_equal(outliers_flagged(e, EVERYWHERE), off)


@pytest.mark.parametrize("place", [0, -1])
def test_a_first_or_last_reading_that_is_off_is_flagged(place):
    e, _ = errors(rate=0.0)
    e[1, place] += 50.0
    assert outliers_flagged(e, EVERYWHERE).sum() == 1


def test_gaussian_noise_has_no_outliers():
    assert sum(outliers_flagged(errors(rate=0.0, seed=seed)[0], EVERYWHERE).sum() for seed in range(20)) == 0
    assert outliers_found(errors(rate=0.0)[0], EVERYWHERE) == []


@pytest.mark.parametrize("freedom", [1.8, 2.5])
def test_noise_with_heavy_tails_has_no_outliers(freedom):
    """Large errors are rare there too, but nothing sets them apart from the others."""
    for seed in range(10):
        e = np.random.default_rng(seed).standard_t(freedom, (*SHAPE, 1))
        assert outliers_flagged(e, EVERYWHERE).sum() >= 10
        assert outliers_found(e, EVERYWHERE) == []


def test_a_model_that_is_wrong_for_a_while_has_no_outliers():
    e, _ = errors(rate=0.0)
    e[1, 100:140] += 20.0
    assert not outliers_flagged(e, EVERYWHERE).any()


def test_what_was_not_measured_is_never_an_outlier():
    e, off = errors()
    measured = EVERYWHERE & ~off[:, :, 0]
    assert not outliers_flagged(e, measured).any()


def test_rate_size_and_share_are_those_of_the_readings_that_are_off():
    e, off = errors()
    ((output, rate, size, share, _),) = outliers_found(e, EVERYWHERE)
    assert output == 0
    assert rate == off.mean()
    assert size == pytest.approx(np.sqrt(np.mean(e[off] ** 2)))
    assert share == pytest.approx(np.sum(e[off] ** 2) / np.sum(e**2))


def test_the_likelihood_ratio_is_that_of_two_sizes_of_error_against_one():
    e, off = errors(rate=0.05)
    ((*_, ratio),) = outliers_found(e, EVERYWHERE)
    # Which reading is off is told with certainty: two normal densities with their shares against a single one.
    n, far, p = e.size, off.sum(), off.mean()
    two = -far * np.log(np.sqrt(np.mean(e[off] ** 2)) / p) - (n - far) * np.log(np.std(e[~off]) / (1 - p))
    assert ratio == pytest.approx(two + n * np.log(np.std(e)), rel=1e-3)


def test_two_readings_are_too_few_and_a_quarter_of_all_are_too_many_to_be_outliers():
    few, many = errors(rate=0.0)[0], errors(rate=0.0)[0]
    few[0, [50, 90]] += 50.0
    many[:, 1::4] += 50.0
    assert outliers_flagged(few, EVERYWHERE).sum() == 2 and outliers_found(few, EVERYWHERE) == []
    assert outliers_flagged(many, EVERYWHERE).sum() == 300 and outliers_found(many, EVERYWHERE) == []


def test_only_the_output_that_has_outliers_is_named():
    clean, (dirty, _) = errors(rate=0.0, seed=1)[0], errors()
    assert [found[0] for found in outliers_found(np.concatenate((clean, dirty), axis=2), EVERYWHERE)] == [1]


def test_what_is_off_is_left_out_of_the_records():
    e, off = errors()
    measured = EVERYWHERE.copy()
    measured[2, 300:] = False
    np.testing.assert_array_equal(measured_without_outliers(e, measured), measured & ~off[:, :, 0])


def test_a_search_fits_its_plain_model_to_the_rest():
    rng = np.random.default_rng(3)
    u = steps(rng, (4, 200))
    y = free_run(velocity(), u, 0.1)[0] + 0.02 * rng.standard_normal((4, 200, 1))
    off = rng.random(y.shape) < 0.02
    made = experiments(u, y + 1.0 * off, 0.1)
    search = plain_search(made[:3], made[3:], "velocity")
    rest = plain_errors(search)
    assert len(rest) == 600 - off[:3].sum()
    # The spread of N errors is known to 1 / sqrt(2 N); four of that.
    assert rest.std() == pytest.approx(0.02, rel=4 / np.sqrt(2 * len(rest)))


def test_errors_of_a_delay_after_each_step_of_a_loop_are_no_outliers():
    answer = diagnose(hide("speed_loop", {"input_delay": 0.25}, noise=0.05, seed=14), views_too=False)
    assert [cause.effect for cause in answer.causes] == ["input_delay"]
