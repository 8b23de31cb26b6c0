"""Signals that a design tries: within the range, no faster than the rate, the same from the same seed."""

import numpy as np
import pytest

from simgap.experiment_design.signals import KINDS, Shape, grid, slowed


@pytest.mark.parametrize("kind", KINDS)
def test_every_signal_stays_within_the_range_and_uses_it(kind):
    u = Shape(kind, 1.0, 0.3, 30.0, 2).between(-2.0, 6.0, 300)
    assert u.shape == (300,)
    assert u.min() >= -2.0 and u.max() <= 6.0
    assert np.ptp(u) > 4.0


@pytest.mark.parametrize("kind", KINDS)
def test_a_small_signal_lies_where_its_centre_says(kind):
    u = Shape(kind, 0.1, 1.0, 30.0, 2).between(-2.0, 6.0, 300)
    assert u.min() >= 5.2 - 1e-12 and u.max() <= 6.0


@pytest.mark.parametrize("kind", KINDS)
def test_its_fastest_part_has_about_its_period(kind):
    u = Shape(kind, 1.0, 0.0, 20.0, 1).within_one(2000)
    power = np.abs(np.fft.rfft(u - u.mean())) ** 2
    faster = np.fft.rfftfreq(2000) > 1.5 / 20
    assert power[faster].sum() < 0.3 * power.sum()


def test_no_signal_is_faster_than_the_rate_and_slow_ones_stay_as_they_are():
    fast = np.stack([Shape("switching", 1.0, 0.0, 20.0, seed).between(-5.0, 5.0, 200) for seed in range(3)])
    slow = 0.01 * np.arange(200.0)[None]
    assert np.abs(np.diff(slowed(fast, 4.0, 0.1))).max() == pytest.approx(0.4)
    assert (slowed(slow, 4.0, 0.1) == slow).all()


def test_the_grid_and_what_is_varied_are_drawn_from_seeds():
    rng = np.random.default_rng
    assert grid(100) == grid(100)
    assert grid(100)[0].varied(100, rng(1)) == grid(100)[0].varied(100, rng(1))
    for seed in range(50):
        one = grid(100)[seed].varied(100, rng(seed))
        assert 0 < one.size <= 1 and -1 <= one.centre <= 1 and 2 <= one.period <= 100
