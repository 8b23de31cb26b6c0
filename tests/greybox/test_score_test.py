"""The score test: what an effect would gain, told without fitting it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares
from scipy.stats import chi2, kstest

from .building import gain_of_refit, plain_errors, plain_search, score_of, scores_of
from .parts import experiments
from .plants import free_run, position, steps, velocity

DT = 0.1
LENGTHS = [150, 110, 150]  # records that differ in length are padded, and the padding must not count
GAIN = 2.0
# What the effect does to the input before it reaches the plant.
DISTORTED = {
    "constant_load": lambda u, p: u + p / GAIN,
    "asymmetric_gain": lambda u, p: u + p * np.abs(u),
    "dead_zone": lambda u, p: np.sign(u) * np.maximum(np.abs(u) - p, 0.0),
}


def searched(effect, size, seed=0, noise=0.05, scales=(1.0, 1.0, 1.0)):
    """A search on a first-order plant with an effect of that size; scales are of time, input and output."""
    rng, (of_t, of_u, of_y) = np.random.default_rng(seed), scales
    u = steps(rng, (3, 150), low=-0.6)
    y, _ = free_run(velocity(gain=GAIN), DISTORTED[effect](u, size), DT)
    y = y + noise * rng.standard_normal(y.shape)
    made = experiments(of_u * u, of_y * y, of_t * DT, LENGTHS)
    return plain_search(made[:2], made[2:], "velocity")


def refit(search, effect, with_effect):
    """The errors and parameters of a free run fitted by scipy: rate, gain, size of the effect, a start per record."""
    data = [(x[:, 0], y[measured, 0]) for x, y, measured in
            zip(search.train.u, search.train.y, search.train.mask, strict=True)]  # fmt: skip

    def errors(p):
        size = p[2] if with_effect else 0.0
        runs = [free_run(velocity(p[0], p[1]), DISTORTED[effect](u[None, : len(y)], size), DT, start)[0][0, :, 0]
                for (u, y), start in zip(data, p[3:], strict=True)]  # fmt: skip
        return np.concatenate([y - run for (_, y), run in zip(data, runs, strict=True)])

    found = least_squares(errors, [1.5, 2.0, 0.0, *(0.0 for _ in data)], xtol=1e-10, ftol=1e-12)
    return found.fun, found.x


@pytest.mark.parametrize(("effect", "size"), [("constant_load", 0.05), ("asymmetric_gain", 0.04)])
def test_the_score_of_an_effect_that_is_there_is_what_a_refit_gains(effect, size):
    search = searched(effect, size)
    without, _ = refit(search, effect, with_effect=False)
    along, parameters = refit(search, effect, with_effect=True)
    gain = 0.5 * len(along) * np.log(np.vdot(without, without) / np.vdot(along, along))
    assert 4 < gain < 60  # enough to be seen, small enough for a first-order test
    score, values = score_of(search, effect)
    assert np.vdot(plain_errors(search), plain_errors(search)) == pytest.approx(np.vdot(without, without), rel=1e-5)
    assert score == pytest.approx(gain, rel=0.05)
    assert values[0] == pytest.approx(parameters[2], rel=0.05)
    assert gain_of_refit(search, effect) == pytest.approx(gain, abs=0.05)  # as closely as the search fits


def test_where_no_load_is_the_score_is_that_of_one_parameter_too_many():
    scores = np.array([score_of(searched("constant_load", 0.0, seed), "constant_load")[0] for seed in range(60)])
    # Wilks: twice the log-likelihood ratio of one needless parameter is chi-squared with one degree of freedom.
    low, high = chi2.ppf([1e-4, 1 - 1e-4], 60)
    assert low < 2 * scores.sum() < high
    assert kstest(2 * scores, chi2(1).cdf).pvalue > 1e-3


@pytest.mark.parametrize(("effect", "size"),
                         [("constant_load", 0.1), ("constant_load", -0.1), ("asymmetric_gain", -0.04)])  # fmt: skip
def test_the_amplitude_moves_to_about_the_true_one_of_either_sign(effect, size):
    score, values = score_of(searched(effect, size, noise=0.005), effect)
    assert score > 50
    assert values[0] == pytest.approx(size, rel=0.1)


def test_the_stiffness_of_a_spring_is_about_the_true_one():
    rng = np.random.default_rng(1)
    u = steps(rng, (3, 200), hold=8)
    fine = 50  # x'' = 3 u - 4 x - 1.2 v - k x^3 by the method of Heun, 50 steps a sample
    k, h, x, v = 0.1, DT / fine, np.zeros(3), np.zeros(3)
    y = np.zeros((3, 200, 1))

    def rates(x, v, u):
        return v, 3 * u - 4 * x - 1.2 * v - k * x**3

    for i in range(200):
        y[:, i, 0] = x
        for _ in range(fine):
            first = rates(x, v, u[:, i])
            second = rates(x + h * first[0], v + h * first[1], u[:, i])
            x, v = (z + h / 2 * (a + b) for z, a, b in zip((x, v), first, second, strict=True))
    search = plain_search(experiments(u, y, DT)[:2], experiments(u, y, DT)[2:], "position")
    assert score_of(search, "cubic_stiffness")[1][0] == pytest.approx(k, rel=0.1)


def test_an_effect_that_only_goes_one_way_scores_nothing_where_the_data_ask_for_the_opposite():
    assert score_of(searched("dead_zone", 0.05, noise=0.01), "dead_zone")[0] > 20
    # Small inputs arrive too large, not too small.
    opposite = searched("dead_zone", -0.05, noise=0.01)
    assert all(gain == 0 for gain, _ in scores_of(opposite, "dead_zone"))


def test_what_the_plant_can_do_as_well_scores_nothing():
    rng = np.random.default_rng(3)
    u = steps(rng, (3, 150), low=0.1)  # of one sign, so that an asymmetric gain is a gain
    y = free_run(velocity(), u, DT)[0] + 0.05 * rng.standard_normal((3, 150, 1))
    search = plain_search(experiments(u, y, DT)[:2], experiments(u, y, DT)[2:], "velocity")
    assert score_of(search, "asymmetric_gain")[0] < 0.1


@settings(max_examples=8, deadline=None, derandomize=True)
@given(scales=st.tuples(*[st.floats(-4, 4).map(lambda p: 10**p)] * 3))
def test_the_score_does_not_depend_on_the_units_of_time_input_and_output(scales):
    of_t, of_u, of_y = scales
    for effect, size, unit in (("constant_load", 0.1, of_y / of_t), ("asymmetric_gain", 0.1, 1.0),
                               ("dead_zone", 0.1, of_u)):  # fmt: skip
        plain, scaled = (score_of(searched(effect, size, scales=s), effect) for s in ((1.0, 1.0, 1.0), scales))
        assert scaled[0] == pytest.approx(plain[0], rel=1e-3)
        assert scaled[1][0] == pytest.approx(unit * plain[1][0], rel=1e-3)


def test_the_order_of_the_scores_puts_the_effect_that_is_there_first():
    search = searched("dead_zone", 0.1, noise=0.02)
    scores = {effect: score_of(search, effect)[0] for effect in DISTORTED}
    assert max(scores, key=scores.__getitem__) == "dead_zone"


def test_a_position_measured_with_its_velocity_tells_a_load_from_both():
    rng = np.random.default_rng(4)
    u = steps(rng, (3, 200))
    y = free_run(position(ny=2), u + 0.05, DT)[0] + [0.01, 0.03] * rng.standard_normal((3, 200, 2))
    made = experiments(u, y, DT)
    assert score_of(plain_search(made[:2], made[2:], "position", ny=2), "constant_load")[1][0] == pytest.approx(
        3 * 0.05, rel=0.1
    )
