"""A log of a positioning axis: long, sampled fast, in closed loop, of a plant that integrates."""

import math

import numpy as np
import pytest

import simgap
from simgap.data.splits import assemble
from simgap.records import Channel, Channels, Experiment

pytestmark = pytest.mark.slow

DT = 1e-3
MASS, VISCOUS, FORCE_PER_VOLT = 95.1, 203.5, 35.15  # kg, N s/m, N/V: the EMPS (Janot, Gautier and Brunot 2019)

LEAD = 0.02  # m, of a turn


def moves(rng, samples):
    """Go from place to place with acceleration and speed limited, and rest there."""
    x, path = 0.0, []
    while len(path) < samples:
        goal, fastest, rate = rng.uniform(0.0, 0.25), rng.uniform(0.05, 0.3), rng.uniform(0.5, 2.5)
        way = abs(goal - x)
        speed = min(fastest, math.sqrt(rate * way))
        rise = speed / rate
        whole = way / speed + rise
        t = np.arange(0.0, whole, DT)
        gone = np.where(t < rise, 0.5 * rate * t**2, 0.5 * rate * rise**2 + speed * (t - rise))
        gone = np.where(t > whole - rise, way - 0.5 * rate * (whole - t) ** 2, gone)
        path += [*(x + math.copysign(1.0, goal - x) * gone), *[goal] * int(rng.uniform(0.05, 0.4) / DT)]
        x = goal
    return path[:samples]


def record(rng, samples, friction=0.0, load=0.0, ripple=0.0):
    """Simulate the axis under its controller: voltage, position by an encoder of 1 um, a load that wanders.

    The ripple in N repeats with every turn of a screw.
    """
    position = speed = seen = seen_speed = wandering = 0.0
    u, y = np.empty((samples, 1)), np.empty((samples, 1))
    for k, goal in enumerate(moves(rng, samples)):
        reading = round(position, 6)
        seen_speed += 0.1 * ((reading - seen) / DT - seen_speed)
        seen = reading
        voltage = min(max(1.6 * (160.0 * (goal - reading) - seen_speed), -10.0), 10.0)
        u[k], y[k] = voltage, reading
        wandering = 0.9995 * wandering + 0.004 * rng.standard_normal()
        force = FORCE_PER_VOLT * voltage + load + wandering - ripple * math.sin(2 * math.pi * position / LEAD)
        pushed = speed + DT * (force - VISCOUS * speed) / MASS
        speed = math.copysign(max(abs(pushed) - DT * friction / MASS, 0.0), pushed)
        position += DT * speed
    return u, y


def axis(seed, **hidden):
    rng = np.random.default_rng(seed)
    train, valid, test = ([Experiment("x", *record(rng, n, **hidden), DT)] for n in (12_000, 4000, 10_000))
    channels = Channels((Channel("motor", "V"),), (Channel("position", "m", "position"),))
    return assemble("axis", (train, valid, test), channels, 20, "axis")


@pytest.mark.parametrize("seed", [1, 2])
def test_friction_and_a_load_are_named_though_either_alone_is_carried_away_over_a_whole_record(seed):
    found = simgap.diagnose(axis(seed, friction=20.4, load=3.2), views_too=False)
    assert found.verdict == "named"
    assert {cause.effect for cause in found.causes} == {"coulomb_friction", "constant_load"}
    said = {cause.effect: cause.parameters[0].value for cause in found.causes}
    assert said["coulomb_friction"] == pytest.approx(20.4 / MASS, rel=0.1)
    assert said["constant_load"] == pytest.approx(3.2 / MASS, rel=0.3)


def test_friction_and_what_repeats_with_every_turn_of_the_screw_are_named_with_their_sizes():
    found = simgap.diagnose(axis(4, friction=20.4, ripple=10.0), views_too=False)
    assert found.verdict == "named"
    said = {cause.effect: [one.value for one in cause.parameters] for cause in found.causes}
    assert set(said) == {"coulomb_friction", "position_torque"}
    assert said["coulomb_friction"][0] == pytest.approx(20.4 / MASS, rel=0.1)
    assert abs(said["position_torque"][0]) == pytest.approx(10.0 / MASS, rel=0.1)
    assert said["position_torque"][1] == pytest.approx(LEAD, rel=0.01)


def test_nothing_is_named_where_nothing_is_hidden():
    found = simgap.diagnose(axis(3), views_too=False)
    assert found.causes == ()
