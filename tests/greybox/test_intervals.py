"""The 95 % intervals of a fitted plant: they hold the truth as often as they say, and are not wide for nothing."""

import numpy as np
import pytest
from scipy.stats import binom
from twins import PAIRS, with_record

from simgap.greybox.intervals import intervals as ends_of
from simgap.greybox.machine import NAMES
from simgap.registry import MODELS

from .building import plain_search, plant_with_interval
from .parts import experiments
from .plants import coloured, free_run, steps, velocity

TRUE = np.array([1.5, 2.0])  # rate and gain
SEEDS = 40


def intervals(colour, shape, dt):
    """Estimates and ends of intervals [3, seeds, 2] from data sets that differ in their noise alone."""
    rng = np.random.default_rng(0)
    u = steps(rng, shape, low=-0.6)
    y, _ = free_run(velocity(*TRUE), u, dt, rng.uniform(-0.5, 0.5, (len(u), 1)))
    found = []
    for seed in range(SEEDS):
        e, _ = coloured(np.random.default_rng([1, seed]), u.shape, colour, 0.05)
        made = experiments(u, y + e[:, :, None], dt)
        found.append(plant_with_interval(plain_search(made[:-1], made[-1:], "velocity"), made))
    return np.swapaxes(found, 0, 1)


@pytest.mark.parametrize(
    ("colour", "shape", "dt"),
    [((), (4, 150), 0.1), ((0.6,), (4, 150), 0.1), ((), (20, 30), 0.02)],
    ids=["white", "coloured", "as short as the transient"],
)
def test_the_intervals_hold_the_truth_in_about_95_percent_of_the_cases(colour, shape, dt):
    theta, low, high = intervals(colour, shape, dt)
    held = np.sum((low <= TRUE) & (high >= TRUE), axis=0)
    # Of 40 intervals that hold the truth with 0.95, fewer than this do once in ten thousand.
    assert (held >= binom.ppf(1e-4, SEEDS, 0.95)).all(), held
    # Nor are they wide for nothing: 1.96 standard deviations of the estimates (known to 1 / sqrt(80) = 11 %), four of
    # those errors either way, and 3 % for Student's t with 39 degrees of freedom.
    ratio = (high - low).mean(axis=0) / 2 / (1.96 * theta.std(axis=0))
    assert (ratio > 0.6).all() and (ratio < 1.5).all(), ratio


def test_an_interval_shrinks_with_the_root_of_the_samples():
    rng = np.random.default_rng(2)
    u = steps(rng, (64, 100), low=-0.6)
    made = experiments(u, free_run(velocity(*TRUE), u, 0.1)[0] + 0.05 * rng.standard_normal((64, 100, 1)), 0.1)
    search = plain_search(made[:3], made[3:4], "velocity")
    widths = [np.subtract(*plant_with_interval(search, made[:n])[:0:-1]) for n in (16, 64)]
    np.testing.assert_allclose(widths[0] / widths[1], 2.0, rtol=0.35)  # a width from 40 blocks is known to 11 %


def test_the_intervals_of_a_machine_hold_the_truth_where_one_short_record_tells_most():
    """Two weak records and one lively one: the fit makes the few errors small that tell most of gain and inertia."""
    twins, held = PAIRS["motor or arm"], np.zeros(3)
    for seed in range(SEEDS):
        truth, _ = twins.names(seed)
        machine, data = twins.machines[truth], twins.at_hand(twins.machines[truth], seed)
        lively = twins.usual_input(machine, 80, 3.0, np.random.default_rng([2, seed]))
        data = with_record(data, machine.record(lively, twins.noise, (3, seed)))
        model = MODELS["greybox"](effects=())
        model.fit(data.training, seed)
        plant = model.plants[0]
        total = {"gain": 1.0, "inertia": 8 / 6}[truth]  # kg m^2, of which the known mass on its arm makes 0.5
        true = np.array([total - 0.5, machine.rig.damping * total, machine.rig.gain * total])
        at = [NAMES.index("inertia"), NAMES.index("damping"), plant.estimate.plant.layout.gains.start]
        low, high = ends_of(plant)
        held += (low[at] <= true) & (high[at] >= true)
    assert (held >= binom.ppf(1e-4, SEEDS, 0.95)).all(), held


@pytest.mark.slow
def test_the_intervals_hold_the_truth_where_one_record_is_long_and_many_are_short():
    """Blocks are cut by samples: else a record of 4000 would be one draw of forty."""
    rng, held, seeds = np.random.default_rng(4), np.zeros(2), 20
    lengths = [2000] + [50] * 39
    u = steps(rng, (40, 2000), low=-0.6)
    y, _ = free_run(velocity(*TRUE), u, 0.1, rng.uniform(-0.5, 0.5, (40, 1)))
    for seed in range(seeds):
        e, _ = coloured(np.random.default_rng([4, seed]), u.shape, (0.95,), 0.05)
        made = experiments(u, y + e[:, :, None], 0.1, lengths)
        _, low, high = plant_with_interval(plain_search(made, made[-1:], "velocity"), made)
        held += (low <= TRUE) & (high >= TRUE)
    assert (held >= binom.ppf(1e-4, seeds, 0.95)).all(), held
