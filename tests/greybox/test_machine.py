"""A machine of which something is known: a servo with its controller inside, a cart, a wheel and a tank."""

import math
from dataclasses import replace

import numpy as np
import pytest

from simgap.data.formats.plant_table import read_plant
from simgap.data.simulated.rigs import hide, physical
from simgap.data.simulated.rigs.plants import RIGS
from simgap.diagnosis.diagnose import diagnose
from simgap.greybox.additions import extend
from simgap.greybox.machine import INERTIA, NAMES, machine_of
from simgap.greybox.machine_baseline import find_machine_baseline
from simgap.greybox.terms import Term
from simgap.records import Channel, Channels, Experiment
from simgap.registry import EFFECTS, MODELS

DT, FINE = 0.01, 20


def servo(name, goal, kp, mass, arm=0.1, rate=math.inf, coulomb=0.0, on=None):
    """Integrate J q'' = k kp (r - q) - d q' - m g l sin q - friction in steps of 0.5 ms, r of limited speed."""
    rotor, k, d, h = 0.02, 1.0, 0.3, DT / FINE
    inertia, q, v, r, reached = rotor + mass * arm**2, 0.0, 0.0, goal[0], []
    on = np.ones(len(goal)) if on is None else on
    for wanted, enabled in zip(goal, on, strict=True):
        reached.append(q)
        for _ in range(FINE):
            r += min(max(wanted - r, -rate * h), rate * h)
            torque = enabled * k * kp * (r - q) - d * v - mass * 9.80665 * arm * math.sin(q)
            free = v + h / inertia * torque
            v = math.copysign(max(abs(free) - h / inertia * coulomb, 0.0), free)
            q += h * v
    y = np.array(reached) + 1e-4 * np.random.default_rng(len(name)).normal(size=len(goal))
    n = len(goal)
    u = np.column_stack([goal, on, np.full(n, kp), np.full(n, mass), np.full(n, arm)])
    return Experiment(name, u, y[:, None], DT)


CHANNELS = Channels(
    (Channel("goal", "rad"), Channel("on"), Channel("kp"), Channel("mass", "kg"), Channel("arm", "m")),
    (Channel("q", "rad", "position"),),
)
TABLE = {
    "mass": "mass", "arm": "arm", "gravity": True, "enabled": "on", "controller": {"goal": "goal", "gain": "kp"},
}  # fmt: skip


def known(channels, table):
    return Channels(channels.inputs, channels.outputs, read_plant(table, channels, "data"))


def runs(**changes):
    t = DT * np.arange(250)
    goals = {"step": 1.2 * (t > 0.2), "sine": np.sin(4 * t), "wave": 0.5 * np.sin(9 * t)}
    return [
        servo(f"{name}_{kp}_{mass}", goal, kp, mass, **changes)
        for kp in (8.0, 20.0) for mass in (0.5, 1.1) for name, goal in goals.items()
    ]  # fmt: skip


def numbers(baseline):
    return dict(zip((*NAMES, "gain"), baseline.estimate.theta, strict=True))


def test_inertia_damping_and_gain_of_a_servo_are_found_beside_its_known_mass():
    baseline = find_machine_baseline(runs(), [], known(CHANNELS, TABLE), (0,), 10)
    found = numbers(baseline)
    assert found["inertia"] == pytest.approx(0.02, rel=0.1)
    assert found["damping"] + found["back_emf"] == pytest.approx(0.3, rel=0.1)
    assert found["gain"] == pytest.approx(1.0, rel=0.05)
    assert np.std(baseline.estimate.errors) < 4e-3


def test_a_servo_simulates_a_mass_and_a_gain_that_it_never_saw():
    baseline = find_machine_baseline(runs(), [], known(CHANNELS, TABLE), (0,), 10)
    other = servo("other", np.sin(5 * DT * np.arange(300)), 14.0, 0.8)
    problem = baseline.problem(baseline.plant)
    simulator = type(problem.simulator)(baseline.plant, other.u[None])
    y = simulator.run(baseline.estimate.theta, np.zeros((1, 2)))[0]
    assert np.abs(y - other.y).mean() < 4e-3


@pytest.mark.parametrize(
    ("effect", "hidden", "size"),
    [("rate_limit", {"rate": 3.0}, 3.0), ("coulomb_friction", {"coulomb": 0.3}, 0.3)],
)
def test_an_effect_in_a_servo_is_found_with_its_size(effect, hidden, size):
    baseline = find_machine_baseline(runs(**hidden), [], known(CHANNELS, TABLE), (0,), 10)
    plant = baseline.plant
    term = Term(EFFECTS[effect](), plant.machine.of_drive if effect == "rate_limit" else 0)
    fit = extend(baseline, baseline.estimate, term)
    assert fit is not None and fit.squares < 0.2 * baseline.estimate.squares
    assert fit.theta[fit.plant.part_of(term)][0] == pytest.approx(size, rel=0.15)


def test_a_doubted_mass_is_estimated_within_its_interval():
    table = {**TABLE, "arm": "arm", "inertia": 0.02, "mass": {"low": 0.3, "high": 0.9}}
    channels = Channels(tuple(c for c in CHANNELS.inputs if c.name != "mass"), CHANNELS.outputs)
    experiments = [Experiment(x.name, np.delete(x.u, 3, 1), x.y, x.dt) for x in runs() if x.u[0, 3] == 0.5]
    baseline = find_machine_baseline(experiments, [], known(channels, table), (0,), 10)
    assert numbers(baseline)["mass"] == pytest.approx(0.5, rel=0.1)


def driven(kind, mass, damping, n=400):
    """A body of some mass under a known force, and what moves: x or x'."""
    rng = np.random.default_rng(int(10 * mass))
    force, x, v, rows, h = np.repeat(rng.normal(size=n // 10), 10), 0.0, 0.0, [], 0.05 / FINE
    for f in force:
        rows.append(x if kind == "position" else v)
        for _ in range(FINE):
            v += h * (f - damping * v) / mass
            x += h * v
    return Experiment(f"{kind}_{mass}", np.column_stack([force, np.full(n, mass)]), np.array(rows)[:, None], 0.05)


@pytest.mark.parametrize(
    ("kind", "unit", "table"),
    [
        ("position", "m", {"mass": "m"}),
        ("velocity", "rad/s", {"inertia": "m"}),
        ("level", "m", {"area": "m"}),
    ],
)
def test_a_cart_a_wheel_and_a_tank_have_the_mass_inertia_or_area_of_each_run(kind, unit, table):
    of_mass = {"position": "kg", "velocity": "kg m^2", "level": "m^2"}[kind]
    channels = known(Channels((Channel("f", "N"), Channel("m", of_mass)), (Channel("y", unit, kind),)), table)
    experiments = [driven("position" if kind == "position" else "velocity", m, 0.7) for m in (0.5, 1.0, 2.0)]
    baseline = find_machine_baseline(experiments, [], channels, (0,), 10)
    found = numbers(baseline)
    assert found["inertia"] == pytest.approx(0.0, abs=0.03)
    assert found["damping"] == pytest.approx(0.7, rel=0.05)
    assert found["gain"] == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize("effect", ["sqrt_outflow", "overflow"])
def test_what_leaves_a_tank_is_found_whatever_its_known_area(effect):
    data = hide("tank", {effect: 1.0}, noise=0.0, seed=7).training
    squares = []
    for area in ("1 cm^2", "0.2 m^2", "30 m^2"):
        model = MODELS["greybox"](effects=("sqrt_outflow", "overflow") if effect == "overflow" else (effect,))
        model.fit(replace(data, channels=known(data.channels, {"area": area})), 0)
        squares.append(np.mean(model.plants[0].estimate.errors ** 2))
    assert max(squares) < 1e-4 * np.var(np.concatenate([x.y for x in data.train]))
    assert max(squares) == pytest.approx(min(squares), rel=1e-3)


def test_of_a_machine_without_a_known_mass_the_inertia_is_one():
    channels = known(Channels((Channel("f"),), (Channel("x", "m", "position"),)), {"damping": 0.7})
    x = driven("position", 1.0, 0.7)
    baseline = find_machine_baseline([Experiment("a", x.u[:, :1], x.y, x.dt)], [], channels, (0,), 10)
    assert baseline.plant.parameters[INERTIA].fixed
    assert numbers(baseline)["gain"] == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize(("strength", "seed"), [(1.0, 1), (0.25, 2)])
def test_a_torque_that_folds_back_at_large_errors_is_named_with_its_size(strength, seed):
    answer = diagnose(hide("servo", {"torque_foldback": strength}, noise=0.02, seed=seed), views_too=False)
    assert [(cause.effect, cause.channel) for cause in answer.causes] == [("torque_foldback", "controller")]
    error, lost = answer.causes[0].parameters
    assert error.value == pytest.approx(physical("servo", {"torque_foldback": strength})["torque_foldback"], rel=0.05)
    assert lost.value == pytest.approx(0.6, abs=0.02)


@pytest.mark.parametrize(("strength", "seed"), [(1.0, 1), (0.5, 4)])
def test_the_loop_behind_a_fold_back_has_its_true_gain_and_damping(strength, seed):
    data = hide("servo", {"torque_foldback": strength}, noise=0.02, seed=seed)
    baseline = find_machine_baseline(data.training.train, data.training.valid, data.channels, (0,), data.n_init)
    fit = extend(baseline, baseline.estimate, Term(EFFECTS["torque_foldback"](), baseline.plant.nu))
    found = dict(zip((*NAMES, "gain"), fit.theta, strict=False))
    assert found["gain"] == pytest.approx(RIGS["servo"].gain, rel=0.01)
    assert found["damping"] == pytest.approx(RIGS["servo"].damping, rel=0.01)


def test_nothing_is_named_on_a_servo_that_hides_nothing():
    assert diagnose(hide("servo", {}, seed=5), views_too=False).verdict == "nothing_found"


def test_a_grey_box_with_an_effect_by_name_knows_the_machine():
    model = MODELS["greybox"](effects=("torque_foldback",))
    model.fit(hide("servo", {"torque_foldback": 1.0}, noise=0.0).training, 0)
    plant = model.plants[0].estimate.plant
    assert plant.machine is not None
    assert np.std(model.plants[0].estimate.errors) < 0.01 * np.std(model.plants[0].records.y)


def test_a_log_that_begins_before_the_power_is_on_has_a_drive_all_the_same():
    columns = (*CHANNELS.inputs, Channel("volts", "V"))
    channels = known(Channels(columns, CHANNELS.outputs), TABLE | {"supply": "volts"})
    first = np.array([[[0.0, 1.0, 8.0, 0.5, 0.1, volts]] for volts in (0.0, 0.0, 12.0)])
    assert machine_of(channels, first).drive == 12.0 * 8.0
    assert math.isfinite(machine_of(channels, first[:1]).largest_gain(DT))
