"""A force that repeats over position: found however often it does, and judged by fits that stay in its valley."""

import numpy as np
import pytest

from .building import best_of_round, by_the_other_half, names_of, plain_search, scores_of, sizes_of, with_effects
from .parts import experiments
from .plants import steps

DT, SUBSTEPS = 0.01, 20


def axis(period, amplitude=0.3, samples=700, noise=1e-4):
    """Records of x'' = 3 u - 2 x' - A sin(2 pi x / X) in a loop that leads it anywhere; the last is held out."""
    rng = np.random.default_rng(3)
    goals = steps(rng, (4, samples), hold=120, low=-0.8, high=0.8)
    x, v = np.zeros(4), np.zeros(4)
    inputs, readings = np.zeros((4, samples)), np.zeros((4, samples, 1))
    for k in range(samples):
        readings[:, k, 0] = x
        inputs[:, k] = u = 4.0 * (goals[:, k] - x) - 1.5 * v
        for _ in range(SUBSTEPS):
            v += DT / SUBSTEPS * (3.0 * u - 2.0 * v - amplitude * np.sin(2 * np.pi * x / period))
            x += DT / SUBSTEPS * v
    made = experiments(inputs, readings + noise * rng.standard_normal(readings.shape), DT)
    return plain_search(made[:-1], made[-1:], "position")


@pytest.mark.parametrize("period", [0.7, 0.11, 0.052])
def test_a_force_that_repeats_over_position_is_found_with_its_period(period):
    before, best = best_of_round(axis(period))
    assert names_of(best) == ("position_torque",)
    amplitude, found, _ = sizes_of(best)["position_torque"]
    assert found == pytest.approx(period, rel=1e-3)
    assert abs(amplitude) == pytest.approx(0.3, rel=0.02)
    assert best.estimate.squares < 0.02 * before.estimate.squares


def test_the_best_score_may_be_that_of_another_period():
    period = 0.052
    score, (_, begun, _) = max(scores_of(axis(period), "position_torque"))
    assert score > 0
    assert begun != pytest.approx(period, rel=0.1)


def test_what_is_fitted_to_one_half_of_the_records_forecasts_the_other_in_the_same_valley():
    search = axis(0.11)
    plain, rippled = with_effects(search), with_effects(search, "position_torque")
    before, after = (by_the_other_half(search, made) for made in (plain, rippled))
    assert after.sum() < 0.02 * before.sum()
