"""A drive of several masses whose speed is measured: where its friction acts, and that it is found and not invented."""

import numpy as np
import pytest
from parameters_of_effects import scales

from simgap.data.loading import load
from simgap.data.splits import assemble
from simgap.greybox.effects.coulomb_friction import CoulombFriction
from simgap.greybox.identification import identify
from simgap.greybox.plant import Plant
from simgap.greybox.simulation import Simulator
from simgap.greybox.terms import PlantScales, Term
from simgap.records import Channel, Channels, Experiment

DT, SUBSTEPS = 0.02, 20


def speeds(torque, friction, load, spring, shaft, damping):
    """Simulate v' = torque - damping v - shaft - friction, with a load behind a shaft that twists."""
    h, v, w, twist = DT / SUBSTEPS, 0.0, 0.0, 0.0
    y = np.empty(len(torque))
    for k, drive in enumerate(torque):
        y[k] = v
        for _ in range(SUBSTEPS):
            pulled = spring * twist + shaft * (v - w)
            new = v + h * (drive - damping * v - pulled)
            new = np.sign(new) * max(0.0, abs(new) - h * friction)
            w, twist, v = w + h * pulled / load, twist + h * (v - w), new
    return y


def drive(seed, friction):
    """Four noisy runs of a motor with a load behind a shaft, of which the last one tests."""
    rng = np.random.default_rng(seed)
    load, swing, damping = rng.uniform(0.4, 1.5), 2 * np.pi * rng.uniform(0.8, 2.0), rng.uniform(0.4, 1.5)
    spring = swing**2 / (1 + 1 / load)
    runs = []
    for i in range(4):
        u = np.repeat(2.0 * rng.standard_normal(90), 6)
        y = speeds(u, friction * u.std(), load, spring, 0.1 * spring / swing, damping)
        y += 0.02 * y.std() * rng.standard_normal(len(y))
        runs.append(Experiment(f"run {i}", u[:, None], y[:, None], DT))
    channels = Channels((Channel("torque", "N m"),), (Channel("speed", "rad/s", "velocity"),))
    return assemble("drive", (runs[:2], runs[2:3], runs[3:]), channels, 10, "made")


def effects_of(data):
    """The order that was found, and the effects that no linear model does without."""
    (found,) = identify(data.training)
    plant = found.selection.trial.estimate.plant
    return plant.order, [] if found.linear else [term.effect.name for term in plant.terms]


def test_friction_holds_the_mass_whose_speed_is_measured_as_in_a_loop_in_python():
    load, spring, shaft, damping, friction = 0.7, 40.0, 0.5, 0.8, 1.2
    # From torque to speed, over s^3 + .. : (load s^2 + shaft s + spring) / load.
    a2, a1, a0 = damping + shaft + shaft / load, spring + (spring + damping * shaft) / load, damping * spring / load
    slow = -np.roots([1.0, a2, a1, a0]).real.max()
    section = [a2 - slow, a0 / slow]
    seen = scales("velocity", 3)
    plant = Plant("velocity", 3, 1, DT, zeros=2, scales=PlantScales((seen,), (seen,))).having([Term(CoulombFriction())])
    gain = spring / load
    theta = np.array([*section, slow, gain, shaft / spring, load / spring, friction * gain])
    u = np.repeat(2.0 * np.random.default_rng(0).standard_normal(60), 6)
    y = Simulator(plant, u[None, :, None]).run(theta, np.zeros((1, 3)))[0, :, 0]
    expected = speeds(u, friction, load, spring, shaft, damping)
    assert np.abs(y - expected).max() < 0.03 * np.abs(expected).max()


@pytest.mark.parametrize("seed", range(2))
def test_friction_of_a_drive_with_a_load_behind_a_shaft_is_named(seed):
    order, effects = effects_of(drive(seed, 0.35))
    assert effects == ["coulomb_friction"]
    assert order in (3, 4)


@pytest.mark.parametrize("seed", range(2))
def test_nothing_is_named_where_such_a_drive_has_no_friction(seed):
    assert effects_of(drive(seed, 0.0))[1] == []


@pytest.mark.slow
def test_the_friction_of_the_coupled_drives_is_found_behind_a_sensor_that_loses_the_sign(measured):
    order, effects = effects_of(load("ced"))
    assert order == 3
    assert {"absolute_sensor", "curved_sensor", "coulomb_friction"} <= set(effects)
