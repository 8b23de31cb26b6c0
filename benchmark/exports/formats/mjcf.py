"""`mjcf`: model.xml, one joint of MuJoCo with its actuators; or these in the user's own XML, with a diff."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from jaxtyping import Float

from simgap.exports import joint_models, joint_runs
from simgap.exports.folders import About, file_in
from simgap.exports.gaps import add_gap, gaps_of
from simgap.exports.joint_models import joint_of
from simgap.exports.joint_runs import STIFF
from simgap.exports.joints import MJCF, STANDARD_GRAVITY, Joint, armature, body
from simgap.exports.patching import Robot, patched
from simgap.exports.subjects import CheckRecord, Subject
from simgap.exports.texts import heading

FILE = "model.xml"
refusal, missing, prepare = joint_models.refusal, joint_runs.missing, joint_models.steady


def check(subject: Subject) -> float:
    """Return the limit of the difference. Raises UnusableInput for what MuJoCo cannot hold."""
    joint = joint_of(subject, MJCF, "mjcf")
    gaps_of(subject, joint)
    return joint_runs.limit(joint)


def joint_attributes(joint: Joint, step: float) -> dict[str, str]:
    """The attributes of <joint> that the model gives, in SI units."""
    made = {
        "damping": _series(joint.damping, joint.drag),
        "stiffness": _series(joint.stiffness, *joint.stiffness_by_position),
        "frictionloss": repr(joint.frictionloss),  # of zero, too: the joint of somebody's file may have its own
        "springref": "0",
    }
    if joint.carried is not None:
        made["armature"] = repr(armature(joint))
    soft = f"{2 * step!r} 1"
    if joint.frictionloss:
        made |= {"solimpfriction": STIFF, "solreffriction": soft}
    if joint.limits:
        made |= {"limited": "true", "range": _numbers(*joint.limits), "solimplimit": STIFF, "solreflimit": soft}
    return made


def actuators(joint: Joint, name: str, step: float) -> list[dict[str, str]]:
    """The attributes of <general>, one for each input; a constant load goes with the first one."""
    made = []
    for i, (gain, one) in enumerate(zip(joint.gains, joint.inputs, strict=True)):
        bias, (stiffness, damping) = (joint.bias, joint.holds) if i == 0 else (0.0, (0.0, 0.0))
        actuator = {"name": f"{name}_input{i}", "joint": name, "gainprm": repr(gain)}
        if bias or stiffness:
            actuator |= {"biastype": "affine", "biasprm": _numbers(bias, -stiffness, -damping)}
        if "clip" in one:
            actuator |= {"ctrllimited": "true", "ctrlrange": _numbers(*one["clip"])}
        if one.get("lag", 0.0) > 0:
            actuator |= {"dyntype": "filter", "dynprm": repr(one["lag"])}
        if "reach" in one:
            actuator |= {"forcelimited": "true", "forcerange": _numbers(*(end + bias for end in one["reach"]))}
        if one.get("delay", 0.0) > 0:
            samples = math.ceil(one["delay"] / step) + 2
            actuator |= {"delay": repr(one["delay"]), "nsample": str(samples), "interp": "zoh"}
        made.append(actuator)
    return made


def patch(subject: Subject, file: Path, name: str) -> dict[str, str]:
    """Put the joint into the user's XML: the file and patch.diff, by their names. Raises UnusableInput."""
    gaps, joint = gaps_of(subject, joint_of(subject, MJCF, "mjcf"))
    robot = Robot.read(file, name)
    made, added = actuators(joint, name, robot.timestep), ET.Element("mujoco")
    ET.SubElement(added, "worldbody")
    for gap in gaps:
        made[gap.channel] |= add_gap(added, gap, robot.timestep, name, f"{name}_")
    text, diff = patched(robot, joint, joint_attributes(joint, robot.timestep), made, added)
    return {f"{file.stem}_patched.xml": text, "patch.diff": diff}


def write(subject: Subject, folder: Path) -> None:
    """Write model.xml and joint.json."""
    gaps, joint = gaps_of(subject, joint_of(subject, MJCF, "mjcf"))
    step = joint_runs.timestep(subject, joint)
    root = ET.Element("mujoco", model=subject.name)
    root.append(ET.Comment(f" {re.sub('-+', '-', heading(subject))} "))
    ET.SubElement(root, "compiler", angle="radian", autolimits="false")
    option = ET.SubElement(
        root, "option", timestep=repr(step), integrator="RK4", gravity=_numbers(0.0, 0.0, -STANDARD_GRAVITY),
        tolerance="1e-12", iterations="200",
    )  # fmt: skip
    ET.SubElement(option, "flag", contact="disable")
    mass, centre, about_centre = body(joint)
    link = ET.SubElement(ET.SubElement(root, "worldbody"), "body", name="link")
    moments = _numbers(*[about_centre if joint.kind == "hinge" else mass] * 3)
    ET.SubElement(link, "inertial", mass=repr(mass), pos=_numbers(*centre), diaginertia=moments)
    axis = "0 1 0" if joint.kind == "hinge" else "1 0 0"
    ET.SubElement(link, "joint", {"name": "joint", "type": joint.kind, "axis": axis} | joint_attributes(joint, step))
    section = ET.SubElement(root, "actuator")
    made = actuators(joint, "joint", step)
    for gap in gaps:
        made[gap.channel] |= add_gap(root, gap, step, "joint")
    for actuator in made:
        ET.SubElement(section, "general", actuator)
    joint_runs.write(root, folder / FILE, subject, joint, lambda one: joint_of(one, MJCF, "mjcf"))


def run(folder: Path, about: About, record: CheckRecord) -> Float[np.ndarray, "N ny"]:
    """Step MuJoCo through the record."""
    model = joint_runs.load(file_in(folder, FILE))
    return joint_runs.run(model, joint_runs.read_joint(folder), about, record, effort=False)


def _numbers(*values: float) -> str:
    return " ".join(repr(float(value)) for value in values)


def _series(*values: float) -> str:
    """Coefficients of a series without the zeros at its end, which older versions of MuJoCo do not read."""
    kept = list(values)
    while len(kept) > 1 and not kept[-1]:
        kept.pop()
    return _numbers(*kept)
