"""A flexible joint: its equation, where it is seen, and that it leaves rigid drives and their effects alone."""

import numpy as np
import pytest
from parameters_of_effects import scales
from scipy.linalg import expm

from simgap.data.simulated import field, rigs
from simgap.greybox import two_masses
from simgap.greybox.identification import identify
from simgap.greybox.plant import Plant
from simgap.greybox.simulation import Simulator
from simgap.greybox.terms import PlantScales

from .parts import term


def with_load_friction(kind, order, joint, linear, friction):
    """A plant with friction that grows with the load, and its parameters."""
    seen = scales(kind, order)
    load = term("load_friction")
    plant = Plant(kind, order, 1, 0.05, joint=joint, scales=PlantScales((seen,), (seen,))).having([load])
    theta = np.zeros(plant.size)
    theta[: plant.n_linear], theta[plant.part_of(load)] = linear, friction
    return plant, theta


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


@pytest.mark.parametrize(("drive", "moves"), [(1.9, False), (2.1, True)])
def test_friction_on_a_joint_grows_with_what_the_joint_pulls_and_not_with_where_it_stands(drive, moves):
    # At rest, both masses in one place far away, the teeth carry the drive alone: it moves beyond 1 + 0.5 drive.
    plant, theta = with_load_friction("position", 4, "motor", [1.0, 0.0, 90.0, 60.0, 0.002, 1.0], [1.0, 0.5, 0.0])
    start = np.array([[100.0, 0.0, 100.0, 0.0]])
    y = Simulator(plant, np.full((1, 100, 1), drive)).run(theta, start)[0, :, 0]
    assert (y[-1] > 100.01) == moves


@pytest.mark.parametrize("back_emf", [0.0, 1.0])
def test_back_emf_takes_its_share_of_the_drive_before_the_teeth_carry_it(back_emf):
    # At an even speed v the teeth carry u - e d v, so that u = d v + k (u - e d v).
    d, k, u = 2.0, 0.3, 5.0
    plant, theta = with_load_friction("velocity", 1, "", [d, 1.0], [0.0, k, back_emf])
    y = Simulator(plant, np.full((1, 400, 1), u)).run(theta, np.zeros((1, 1)))[0, :, 0]
    assert y[-1] == pytest.approx(u * (1 - k) / (d * (1 - k * back_emf)), rel=1e-3)


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
