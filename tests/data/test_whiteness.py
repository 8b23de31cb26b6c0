"""The whiteness test: its numbers against the definition, its false alarms, and the gimbal's inputs."""

import numpy as np
import pytest
from scipy.stats import binomtest

from simgap.data.simulated.gimbal.inputs import INPUTS
from simgap.data.whiteness import whiteness
from simgap.records import UnusableInput

WHITE = ["gaussian", "binary", "uniform"]


def alarms(kind, samples, trials, max_lag=20):
    rng = np.random.default_rng(0)
    return sum(not whiteness(INPUTS[kind](samples, rng), max_lag).white for _ in range(trials))


def test_the_autocorrelation_is_the_sum_of_lagged_products():
    u = np.random.default_rng(0).normal(2.0, 3.0, 57)
    centred = u - u.mean()
    by_hand = [np.sum(centred[k:] * centred[: 57 - k]) / np.sum(centred**2) for k in range(11)]
    found = whiteness(u, max_lag=10)
    assert found.autocorrelation == pytest.approx(by_hand)
    assert list(found.lags) == list(range(11))


def test_the_statistic_is_the_one_of_ljung_and_box():
    u = np.random.default_rng(0).normal(size=40)
    r = whiteness(u, max_lag=3).autocorrelation
    by_hand = 40 * 42 * (r[1] ** 2 / 39 + r[2] ** 2 / 38 + r[3] ** 2 / 37)
    assert whiteness(u, max_lag=3).statistic == pytest.approx(by_hand)


def test_the_bound_is_that_of_a_correlation_of_t_samples():
    assert whiteness(np.random.default_rng(0).normal(size=400)).bound == pytest.approx(0.098)


def test_a_lag_of_white_noise_is_outside_its_bound_5_percent_of_the_time():
    rng = np.random.default_rng(0)
    outside = sum(whiteness(rng.normal(size=2000)).outside for _ in range(500))
    assert binomtest(outside, 500 * 20, 0.05).pvalue > 0.01


@pytest.mark.parametrize("kind", WHITE)
def test_white_inputs_raise_a_false_alarm_about_5_percent_of_the_time(kind):
    assert binomtest(alarms(kind, samples=2000, trials=1000), 1000, 0.05).pvalue > 0.01
    # A record of the protocol is short, where the statistic is known to be a little too large.
    assert 0.03 < alarms(kind, samples=200, trials=1000) / 1000 < 0.09


def test_the_joystick_is_never_taken_for_white_noise():
    assert alarms("joystick", samples=200, trials=200) == 200


def test_a_faint_dependence_on_the_sample_before_is_found_given_enough_samples():
    noise = np.random.default_rng(0).normal(size=5001)
    assert not whiteness(noise[1:] + 0.15 * noise[:-1]).white


def test_the_verdict_is_one_sentence_with_its_numbers():
    rng = np.random.default_rng(2)
    passed = whiteness(rng.normal(size=400)).text()
    failed = whiteness(INPUTS["joystick"](400, rng)).text()
    assert passed.startswith("The input passes for white noise: ")
    assert failed.startswith("The input is not white: ")
    assert "outside ±0.098" in failed
    assert "p < 0.001" in failed


@pytest.mark.parametrize(("u", "max_lag"), [(np.full(50, 0.1), 20), (np.arange(20.0), 20), (np.arange(20.0), 0)])
def test_an_input_without_an_autocorrelation_is_refused_with_what_to_do(u, max_lag):
    with pytest.raises(UnusableInput, match=r"; (excite|ask)"):
        whiteness(u, max_lag)
