"""The whiteness test: its numbers against the definition, its false alarms, and the gimbal's inputs."""

import numpy as np
import pytest
from scipy.stats import binomtest, chi2

from simgap.data import describe, load
from simgap.data.simulated.gimbal.inputs import INPUTS
from simgap.data.whiteness import is_white, ljung_box

WHITE = ["gaussian", "binary", "uniform"]


def alarms(kind, samples, trials):
    rng = np.random.default_rng(0)
    return sum(not is_white(INPUTS[kind](samples, rng)) for _ in range(trials))


@pytest.mark.parametrize("n", range(40, 60))  # padded to even and to odd lengths
def test_the_probability_is_that_of_the_sum_of_lagged_products(n):
    u = np.random.default_rng(n).normal(2.0, 3.0, n)
    centred = u - u.mean()
    r = [np.sum(centred[k:] * centred[: n - k]) / np.sum(centred**2) for k in range(4)]
    by_hand = n * (n + 2) * (r[1] ** 2 / (n - 1) + r[2] ** 2 / (n - 2) + r[3] ** 2 / (n - 3))
    assert ljung_box(u, 3) == pytest.approx(chi2.sf(by_hand, 3))


@pytest.mark.parametrize("kind", WHITE)
def test_white_inputs_raise_a_false_alarm_about_5_percent_of_the_time(kind):
    assert binomtest(alarms(kind, samples=2000, trials=1000), 1000, 0.05).pvalue > 0.01
    # A record of the protocol is short, where the statistic is known to be a little too large.
    assert 0.03 < alarms(kind, samples=200, trials=1000) / 1000 < 0.09


def test_the_joystick_is_never_taken_for_white_noise():
    assert alarms("joystick", samples=200, trials=200) == 200


def test_a_faint_dependence_on_the_sample_before_is_found_given_enough_samples():
    noise = np.random.default_rng(0).normal(size=5001)
    assert not is_white(noise[1:] + 0.15 * noise[:-1])


@pytest.mark.parametrize("u", [[0.3], [0.1] * 50, [0.1, 0.1, np.nextafter(0.1, 1)] * 20])
def test_an_input_that_never_moves_is_not_white(u):
    assert not is_white(np.array(u))


def test_a_data_set_whose_input_moves_by_rounding_alone_is_described(tmp_path):
    file = tmp_path / "log.csv"
    file.write_text("u,y\n" + "".join(f"{[0.1, 0.10000000000000002][k % 2]},{k % 5}\n" for k in range(50)))
    assert describe(load(file, ["u"], ["y"], dt=1.0))["inputs"][0]["white_experiments"] == 0
