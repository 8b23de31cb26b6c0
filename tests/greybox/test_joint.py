"""A flexible joint: its equation, where it is seen, and that it leaves rigid drives and their effects alone."""

import numpy as np
import pytest
from scipy.linalg import expm

from simgap.data.simulated import field, rigs
from simgap.greybox import two_masses
from simgap.greybox.identification import identify
from simgap.greybox.plant import Plant
from simgap.greybox.simulation import Simulator


def identified(data):
    """The side of the joint that is measured, and the effects that no linear model does without, of the first plant."""
    first = identify(data.training)[0]
    plant = first.selection.trial.estimate.plant
    return plant.joint, [] if first.linear else [term.effect.name for term in plant.terms]


@pytest.mark.parametrize("side", ["motor", "load"])
def test_a_joint_swings_as_two_masses_on_a_spring(side):
    d, k, p, r, c, b, dt = 1.0, 4.0, 90.0, 60.0, 0.002, 5.0, 0.05
    plant = Plant("position", 4, 1, dt, joint=side)
    rng = np.random.default_rng(0)
    u = rng.standard_normal((1, 200, 1))
    y = Simulator(plant, u).run(np.array([d, k, p, r, c, b]), np.zeros((1, 4)))[0, :, 0]
    a = np.array([[0, 1, 0, 0], [-k - p, -d - p * c, p, p * c], [0, 0, 0, 1], [r, r * c, -r, -r * c]])
    whole = expm(dt * np.block([[a, np.array([[0], [b], [0], [0]])], [np.zeros((1, 5))]]))
    z, expected = np.zeros(4), []
    for value in u[0, :, 0]:
        expected.append(z[{"motor": 0, "load": 2}[side]])
        z = whole[:4, :4] @ z + whole[:4, 4] * value
    assert y == pytest.approx(expected, abs=1e-9)


def test_a_joint_turns_into_a_rigid_drive_where_its_spring_is_hard():
    rigid = np.array([2.0, 9.0])
    for shape in two_masses.shapes(rigid, duration=10.0, dt=0.01):
        d, k, p, r, _ = shape
        assert [d, k] == pytest.approx(rigid * (p + r) / r)  # both masses together


@pytest.mark.slow
@pytest.mark.parametrize(("rig", "seed"), [("joint_motor", 91), ("joint_link", 109)])
def test_a_flexible_joint_is_no_lag_and_no_delay(rig, seed):
    joint, effects = identified(field.hide(rig, {}, noise=0.005, seed=seed))
    assert joint
    assert not {"actuator_lag", "sensor_lag", "input_delay"} & set(effects)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rig", "side", "effect", "seed"),
    [
        ("joint_link", "load", "input_delay", 96),
        ("joint_motor", "motor", "input_delay", 204000),  # without the delay, no joint fits better than a lag
        ("joint_link", "load", "input_saturation", 205009),  # so large that the plain error shows no joint
    ],
)
def test_a_joint_and_an_effect_that_hides_it_are_both_found(rig, side, effect, seed):
    assert identified(field.hide(rig, {effect: 1.0}, noise=0.005, seed=seed)) == (side, [effect])


@pytest.mark.parametrize("effects", [{}, pytest.param({"coulomb_friction": 1.0}, marks=pytest.mark.slow)])
def test_a_rigid_drive_gets_no_joint(effects):
    assert identified(rigs.hide("stage", effects, seed=1)) == ("", list(effects))
