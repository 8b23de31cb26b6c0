"""A machine with a table [plant] in other simulators: its step repeats the compiled loop, and a joint moves as it."""

import json
import runpy
import shutil
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from parameters_of_effects import scales, values_of

from simgap.data.formats.plant_table import read_plant
from simgap.data.splits import assemble
from simgap.exports.export import export
from simgap.exports.grey_boxes import GreyBoxStep
from simgap.greybox.machine import BACK_EMF, DAMPING, INERTIA, NAMES, machine_of
from simgap.greybox.model import FittedPlant
from simgap.greybox.noise import white
from simgap.greybox.plant import Plant
from simgap.greybox.terms import PlantScales, Term
from simgap.records import Channel, Channels, Experiment, UnusableInput
from simgap.registry import EFFECTS, MODELS
from simgap.saved.archive import FittedOn, SavedModel

DT, GOAL, COMMAND = 0.01, 0, 6
SERVO = (
    (Channel("goal", "rad"), Channel("on"), Channel("volts", "V"), Channel("kp"), Channel("mass", "g"),
     Channel("arm", "m")),
    {"mass": "mass", "arm": "arm", "gravity": True, "supply": "volts", "enabled": "on",
     "controller": {"goal": "goal", "gain": "kp", "derivative": 0.2}},
)  # fmt: skip
IN_DEGREES = (
    (Channel("goal", "deg"),),
    {"mass": "0.4 kg", "arm": "0.2 m", "gravity": True, "controller": {"goal": "goal", "gain": 2.0}},
)
CART = ((Channel("force", "N"), Channel("mass", "kg")), {"mass": "mass", "damping": 0.4})
TANK = ((Channel("flow", "m^3/s"), Channel("area", "cm^2")), {"area": "area"})
LENGTH = 300


def machine(inputs, table, kind="position", unit="rad", terms=(), **theta):
    """A machine with these numbers and terms (effect, channel, values), and a record: u, y_init."""
    rng = np.random.default_rng(3)
    t = DT * np.arange(LENGTH)
    columns = {"on": (t < 2.0).astype(float), "volts": 12.0 + 0.2 * np.sin(9 * t), "kp": np.full(LENGTH, 4.0),
               "mass": np.full(LENGTH, 500.0 if inputs is SERVO[0] else 1.5), "arm": np.full(LENGTH, 0.1),
               "area": np.full(LENGTH, 200.0)}  # fmt: skip
    size = {"deg": 40.0}.get(unit, 1.0)
    drive = size * np.sin(4 * t + 2 * np.sin(1.3 * t)) if kind != "level" else 0.01 + 0.01 * np.sin(4 * t)
    u = np.column_stack([columns.get(channel.name, drive) for channel in inputs])
    bare = Channels(inputs, (Channel("q", unit, kind),))
    channels = Channels(inputs, bare.outputs, read_plant(table, bare, "data"))
    order = 2 if kind == "position" else 1
    seen = scales(kind, order)
    plant = Plant(kind, order, len(inputs), DT, scales=PlantScales((seen,) * (len(inputs) + 1), (seen,)),
                  machine=machine_of(channels, u[None])).having([Term(e, at) for e, at, _ in terms])  # fmt: skip
    numbers = np.zeros(plant.size)
    numbers[: len(NAMES)] = plant.machine.start()
    for name, value in theta.items():
        numbers[{"inertia": INERTIA, "damping": DAMPING, "back_emf": BACK_EMF}.get(name, len(NAMES))] = value
    for effect, at, values in terms:
        numbers[plant.part_of(Term(effect, at))] = values
    state = {"plant": plant, "theta": numbers, "noise": white(np.ones(1)), "outputs": (0,), "outliers": (),
             "usual": None}  # fmt: skip
    about = FittedOn("rig", "", DT, 6, Channels(channels.inputs, channels.outputs))
    y_init = 0.02 * size * rng.normal(size=(6, 1))
    model = MODELS["greybox"]()
    model.plants = [FittedPlant.from_saved(state)]
    y = np.concatenate([y_init, np.zeros((LENGTH - 6, 1))])
    return SavedModel("greybox", model, about), Experiment("run", u, y, DT)


def effect(name, channel=0, values=None):
    one = EFFECTS[name]()
    return one, channel, values_of(one, scales())[0] if values is None else np.array(values)


def a_servo(*terms, table=SERVO[1]):
    return machine(SERVO[0], table, terms=terms, inertia=0.02, damping=0.05, back_emf=0.3, gain=0.1)


def differs(saved, x):
    form = GreyBoxStep(saved.model, x.u.shape[1], 1)
    y_hat = saved.model.simulate(x.u[None], x.y[None, :6])[0]
    assert np.isfinite(y_hat).all() and np.std(y_hat) > 1e-4
    return np.max(np.abs(form.form.run(x.u[6:], form.start(x.u, x.y[:6])) - y_hat)) / np.std(y_hat)


@pytest.mark.parametrize(
    "terms",
    [
        (),
        (effect("torque_foldback", COMMAND, [0.3, 0.6]), effect("input_saturation", COMMAND, [1.5])),
        (effect("rate_limit", GOAL, [3.0, 2.0]), effect("actuator_lag", GOAL, [0.03]),
         effect("input_delay", GOAL, [0.027])),
        (effect("load_friction", 0, [0.05, 0.2, 0.0]), effect("stribeck_friction", 0, [0.05, 0.1, 0.2])),
        (effect("hard_stop", 0, [-0.3, 0.4]), effect("hysteresis"), effect("sensor_lag")),
    ],
)  # fmt: skip
def test_a_servo_with_effects_on_goal_command_and_body_runs_as_ours(terms):
    assert differs(*a_servo(*terms)) < 1e-9


@pytest.mark.parametrize(
    ("inputs", "table", "kind", "unit", "numbers"),
    [
        (*IN_DEGREES, "position", "deg", {"inertia": 0.01, "damping": 0.002, "gain": 0.03}),
        (*CART, "position", "mm", {"gain": 3.0}),
        (*CART, "velocity", "m/s", {"inertia": 0.1, "gain": 3.0}),
        (*TANK, "level", "m", {"damping": 0.02, "gain": 1.0}),
    ],
)
def test_a_servo_in_degrees_a_cart_and_a_tank_run_as_ours(inputs, table, kind, unit, numbers):
    assert differs(*machine(inputs, table, kind, unit, **numbers)) < 1e-9


def test_a_tank_that_empties_through_a_hole_and_overflows_runs_as_ours():
    holes = effect("sqrt_outflow", 0, [0.8, 0.05])
    saved, x = machine(*TANK, "level", "m", terms=(holes,), damping=0.02, gain=1.0)
    rim = float(np.percentile(saved.model.simulate(x.u[None], x.y[None, :6])[0], 60))
    terms = holes, effect("overflow", 0, [rim])
    full, x = machine(*TANK, "level", "m", terms=terms, damping=0.02, gain=1.0)
    assert np.max(full.model.simulate(x.u[None], x.y[None, :6])[0]) == rim
    assert differs(saved, x) < 1e-9
    assert differs(full, x) < 1e-9


@pytest.fixture(scope="module")
def rubbing():
    """A servo that MuJoCo can hold, and its record."""
    terms = (effect("coulomb_friction", 0, [0.06]), effect("input_saturation", COMMAND, [1.5]),
             effect("input_delay", GOAL, [0.02]))  # fmt: skip
    saved, x = a_servo(*terms)
    return saved, x, one_run(saved, x)


def one_run(saved, x):
    heavier = Experiment("heavier", x.u * [1, 1, 1, 1.5, 2, 1.5], x.y, DT)
    return assemble("rig", ((x, heavier), (x,), (x,)), saved.fitted_on.channels, 6, "rig")


@pytest.mark.parametrize("form", ["python", "c", "gymnasium"])
def test_an_exported_servo_repeats_its_run_and_a_reversal(rubbing, form, tmp_path):
    if form == "c" and shutil.which("cc") is None:
        pytest.skip("there is no C compiler")
    if form == "gymnasium":
        pytest.importorskip("gymnasium", reason="Gymnasium is not installed")
    saved, _, data = rubbing
    done = export(saved, data, form, tmp_path / "out")
    assert done.passed and done.limit == 1e-6 and {*done.differences} == {"record", "reversal"}, str(done)


def test_an_environment_acts_on_the_goal_and_holds_mass_arm_and_gain(rubbing, tmp_path):
    pytest.importorskip("gymnasium", reason="Gymnasium is not installed")
    saved, _, data = rubbing
    export(saved, data, "gymnasium", tmp_path / "out")
    module = runpy.run_path(str(tmp_path / "out" / "environment.py"))
    assert [module["INPUTS"][i] for i in module["HELD"]] == ["kp", "mass", "arm"]

    def after(held):
        environment = module["Plant"]()
        environment.reset(seed=0, options={"held": held})
        return [environment.step([0.5, 1.0, 12.0])[0][0] for _ in range(60)][-1]

    assert after([4.0, 500.0, 0.1]) > after([4.0, 2000.0, 0.1]) > 0.05, "a heavier arm does not sag"


def test_mujoco_moves_a_servo_as_ours_with_the_masses_of_the_table(rubbing, tmp_path):
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    saved, _, data = rubbing
    done = export(saved, data, "mjcf", tmp_path / "out")
    assert done.passed, str(done)
    root = ET.parse(tmp_path / "out" / "model.xml")
    body, joint, servo = root.find(".//inertial"), root.find(".//joint"), root.find(".//general")
    assert float(body.get("mass")) == pytest.approx(0.5)
    assert [float(p) for p in body.get("pos").split()] == pytest.approx([0, 0, -0.1])
    assert float(joint.get("armature")) == pytest.approx(0.02, rel=1e-4)
    assert float(joint.get("damping")) == pytest.approx(0.05 + 0.3)
    assert float(joint.get("frictionloss")) == pytest.approx(0.06)
    stiffness = 0.1 * 4.0 * np.median(data.test[0].u[:, 2])
    assert float(servo.get("gainprm")) == pytest.approx(stiffness)
    assert [float(p) for p in servo.get("biasprm").split()] == pytest.approx([0, -stiffness, -stiffness / 4.0 * 0.2])
    assert float(servo.get("forcerange").split()[1]) == pytest.approx(stiffness / 4.0 * 1.5)
    assert json.loads((tmp_path / "out" / "joint.json").read_text())["inputs"] == [GOAL]


def test_what_is_known_twice_or_has_no_place_is_refused(rubbing, tmp_path):
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    saved, _, data = rubbing
    with pytest.raises(UnusableInput, match="was fitted with its table"):
        export(saved, data, "python", tmp_path / "out", known={"inertia": 1.0})
    with pytest.raises(UnusableInput, match="urdf cannot hold a controller"):
        plain, x = a_servo()
        export(plain, one_run(plain, x), "urdf", tmp_path / "out")
    with pytest.raises(UnusableInput, match="mjcf cannot hold torque_foldback"):
        folding, x = a_servo(effect("torque_foldback", COMMAND, [0.3, 0.6]))
        export(folding, one_run(folding, x), "mjcf", tmp_path / "out")
