"""A grey box as a joint of MuJoCo and URDF: it moves as ours, in SI units, and says what it cannot hold."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from plants_without_a_fit import DT, grey_box

import simgap
from simgap.cli import main
from simgap.data.formats.plant_table import read_forces
from simgap.data.simulated.rigs import hide
from simgap.data.splits import assemble
from simgap.exports import export as exports
from simgap.exports import joint_runs
from simgap.exports.export import export
from simgap.exports.folders import read_folder
from simgap.exports.joints import CHANGES, MJCF, URDF, effects_table
from simgap.records import Channel, Channels, Experiment, UnusableInput
from simgap.registry import EFFECTS, MODELS
from simgap.saved.archive import FittedOn, SavedModel

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
KNOWN = {"inertia": 0.3}
ON_AN_ARM = {"mass": "1 kg", "arm": "0.2 m"}
WHEEL = """
<mujoco>
  <default><joint damping="0.5"/></default>
  <worldbody>
    <body>
      <joint name="axle" axis="0 0 1"/>
      <inertial mass="1" pos="0 0 0" diaginertia="0.01 0.01 0.01"/>
    </body>
  </worldbody>
  <actuator><motor joint="axle"/></actuator>
</mujoco>
"""
ROBOT = """
<mujoco model="robot">
  <!-- <joint name="rail"/> is below -->
  <worldbody>
    <body>
      <joint name="rail" type="slide"   axis="1 0 0" damping='3' />
      <geom size="0.1" mass="0.1"/>
      <body pos="0.2 0 0"><joint name="tilt" axis="0 1 0"/><geom size=".05" mass="0.05"/></body>
    </body>
  </worldbody>
  <actuator>
    <motor name="push" joint="rail" gear="7"/>
  </actuator>
  <sensor><actuatorfrc actuator="push"/></sensor>
</mujoco>
"""


def fitted(rig, *effects):
    data = hide(rig, dict.fromkeys(effects, 0.5))
    model = simgap.fit("greybox", data, {"effects": list(effects)}).model
    return SavedModel("greybox", model, FittedOn.of(data)), data


@pytest.fixture(scope="module")
def cart():
    return fitted("cart", "coulomb_friction")


def test_the_tables_name_effects_and_the_readme_shows_them():
    assert {*URDF} <= {*MJCF} == {*CHANGES} <= {*EFFECTS}
    assert "\n".join(effects_table()) in (Path(exports.__file__).parent / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("rig", "effects", "forms", "limit"),
    [
        ("cart", ("input_saturation",), ("mjcf", "urdf"), 1e-6),
        ("stage", (), ("mjcf",), 1e-6),
        ("arm", ("gravity", "coulomb_friction"), ("mjcf", "urdf"), 1e-2),
        ("stage", ("input_delay", "cubic_stiffness"), ("mjcf",), 1e-2),
    ],
)
def test_mujoco_moves_the_joint_as_our_simulation(rig, effects, forms, limit, tmp_path):
    saved, data = fitted(rig, *effects)
    for form in forms:
        done = export(saved, data, form, tmp_path / form, known=KNOWN)
        assert done.passed and done.limit == limit, str(done)


def with_backlash(stiffness):
    """A drive with play before it, saved, a record of it, and how far the play takes the motion from one without."""
    model = MODELS["greybox"]()
    model.plants = grey_box("position", [EFFECTS["backlash"]()], [[0.8]]).plants
    model.plants[0].estimate.theta[1] = stiffness
    rng = np.random.default_rng(0)
    u = np.repeat(rng.normal(size=30), 5)[:, None]
    channels = Channels((Channel("u", "V"),), (Channel("x", "deg", "position"),))
    y_hat = model.simulate(u[None], np.zeros((1, 6, 1)))[0]
    x = Experiment("run", u, np.concatenate([np.zeros((6, 1)), y_hat]), DT)
    data = assemble("rig", ((x,), (x,), (x,)), channels, 6, "rig")
    plain = grey_box("position")
    plain.plants[0].estimate.theta[1] = stiffness
    without = plain.simulate(u[None], x.y[None, :6])[0]
    return SavedModel("greybox", model, FittedOn.of(data)), data, np.std(without - y_hat) / np.std(y_hat)


@pytest.mark.parametrize("stiffness", [0.0, 4.0])
def test_a_second_joint_holds_a_command_back_as_backlash_does(stiffness, tmp_path):
    saved, data, difference = with_backlash(stiffness)
    assert difference > 0.1, "the gap makes no difference"
    done = export(saved, data, "mjcf", tmp_path / "out", known=ON_AN_ARM)
    assert done.passed and done.limit == 3e-2, str(done)


def test_backlash_goes_into_the_users_file_and_holds_back_there_too(tmp_path):
    saved, data, _ = with_backlash(4.0)
    (tmp_path / "wheel.xml").write_text(WHEEL)
    export(saved, data, "mjcf", tmp_path / "out", known=ON_AN_ARM, into=tmp_path / "wheel.xml", joint="axle")
    about = read_folder(tmp_path / "out")
    model = joint_runs.load(tmp_path / "out" / "wheel_patched.xml")
    assert [model.joint(i).name for i in range(3)] == ["axle", "axle_stem0", "axle_follower0"]
    (record,) = about.records
    joint = joint_runs.read_joint(tmp_path / "out") | {"substeps": round(DT / model.opt.timestep)}
    assert record.difference(joint_runs.run(model, joint, about, record, effort=False)) < 3e-2


def test_keys_that_lack_the_joints_of_a_backlash_are_refused(tmp_path):
    saved, data, _ = with_backlash(4.0)
    keys = '<keyframe><key name="home" qpos="0"/></keyframe></mujoco>'
    (tmp_path / "wheel.xml").write_text(WHEEL.replace("</mujoco>", keys))
    with pytest.raises(UnusableInput, match="which the key in line 11 does not have"):
        export(saved, data, "mjcf", tmp_path / "out", known=ON_AN_ARM, into=tmp_path / "wheel.xml", joint="axle")


@pytest.mark.slow
@pytest.mark.parametrize("effect", [name for name in MJCF if name not in ("gravity", "input_saturation")])
def test_every_effect_of_the_table_moves_it_so(effect, tmp_path):
    saved, data = fitted("stage", effect)
    assert export(saved, data, "mjcf", tmp_path / "out", known=KNOWN).passed


def test_a_torque_constant_tells_the_inertia(cart, tmp_path):
    saved, data = cart
    export(saved, data, "urdf", tmp_path / "out", known={"torque_constant": 0.3})
    mass = float(ET.parse(tmp_path / "out" / "model.urdf").find(".//mass").get("value"))
    plant = saved.model.plants[0].estimate
    np.testing.assert_allclose(mass * plant.theta[plant.plant.layout.gains], 0.3)


@pytest.mark.parametrize(
    ("rig", "effects", "form", "known", "sentence"),
    [
        ("cart", (), "mjcf", {}, "forces need the inertia of the joint"),
        ("stage", (), "urdf", KNOWN, "cannot hold a spring"),
        ("stage", ("stribeck_friction",), "mjcf", KNOWN, "cannot hold stribeck_friction"),
        ("tank", (), "mjcf", KNOWN, "takes a rigid joint"),
    ],
)
def test_what_it_cannot_hold_is_said(rig, effects, form, known, sentence, tmp_path):
    saved, data = fitted(rig, *effects)
    with pytest.raises(UnusableInput, match=sentence):
        export(saved, data, form, tmp_path / "out", known=known)
    assert not (tmp_path / "out").exists()


def test_the_joint_goes_into_the_users_file_and_nothing_else_changes(cart, tmp_path):
    saved, data = cart
    (tmp_path / "robot.xml").write_text(ROBOT)
    into = {"into": tmp_path / "robot.xml", "joint": "rail"}
    export(saved, data, "mjcf", tmp_path / "out", known=KNOWN, **into)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "robot_patched.xml"))
    alone = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "model.xml"))
    assert model.joint("rail").damping == alone.joint("joint").damping
    assert model.joint("rail").frictionloss == alone.joint("joint").frictionloss
    assert model.actuator("push").gainprm[0] == alone.actuator_gainprm[0, 0]
    np.testing.assert_allclose(model.joint("rail").armature, 0.3 - 0.15)
    diff = (tmp_path / "out" / "patch.diff").read_text().splitlines()
    assert [line[0] for line in diff if line[0] in "+-" and line[:3] not in ("+++", "---")] == ["-", "+", "-", "+"]


@pytest.mark.parametrize(
    ("joint", "inertia", "sentence"),
    [("tilt", 0.3, "is a hinge"), ("wheel", 0.3, "it has rail, tilt"), ("rail", 0.1, "the bodies at rail have 0.15")],
)
def test_a_file_that_does_not_fit_is_refused(cart, joint, inertia, sentence, tmp_path):
    saved, data = cart
    (tmp_path / "robot.xml").write_text(ROBOT)
    with pytest.raises(UnusableInput, match=sentence):
        export(
            saved, data, "mjcf", tmp_path / "out", known={"inertia": inertia}, into=tmp_path / "robot.xml", joint=joint
        )
    assert not (tmp_path / "out").exists()


def test_a_mass_on_an_arm_tells_the_inertia_and_units_are_converted():
    assert read_forces({"mass": "500 g", "arm": "20 cm", "inertia": 0.01}) == {"inertia": pytest.approx(0.03)}
    assert read_forces({"mass": "2 kg"}) == {"inertia": 2.0}
    assert read_forces({}) == {}


def test_what_is_known_of_a_saved_model_is_a_positive_number(cart, tmp_path, capsys):
    saved, data = cart
    simgap.save_model(saved.model, tmp_path / "cart.simgap", data)
    simgap.save(data, tmp_path / "cart")
    for text in ("inertia=-1", "inertia=x", "volume=1", "arm=0.1"):
        arguments = [str(tmp_path / "cart.simgap"), str(tmp_path / "cart"), "--to", "mjcf", "--known", text]
        assert main(["export", *arguments, "--out", str(tmp_path / "new")]) == 2
        assert capsys.readouterr().err.startswith("simgap: --known")
