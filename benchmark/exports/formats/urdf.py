"""`urdf`: model.urdf, one joint with its link; URDF knows no actuator, so a force is gain u (joint.json)."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from jaxtyping import Float

from simgap.exports import joint_models, joint_runs
from simgap.exports.folders import About, file_in
from simgap.exports.joint_models import joint_of
from simgap.exports.joint_runs import engine
from simgap.exports.joints import CANNOT, URDF, Joint, body
from simgap.exports.subjects import CheckRecord, Subject
from simgap.exports.texts import heading
from simgap.records import UnusableInput

FILE = "model.urdf"
refusal, missing, prepare = joint_models.refusal, joint_runs.missing, joint_models.steady
FAR = 1e6  # limits that a URDF asks for where the model has none


def _joint(subject: Subject) -> Joint:
    joint = joint_of(subject, URDF, "urdf")
    springs = {"a spring at the joint": joint.stiffness, "a constant load": joint.bias, "a controller": joint.holds[0]}
    for name, value in springs.items():
        if value:
            raise UnusableInput(f"urdf cannot hold {name}: {CANNOT}; --to mjcf can")
    return joint


def check(subject: Subject) -> float:
    """Return the limit of the difference. Raises UnusableInput for what URDF cannot hold."""
    return joint_runs.limit(_joint(subject))


def write(subject: Subject, folder: Path) -> None:
    """Write model.urdf and joint.json."""
    joint = _joint(subject)
    root = ET.Element("robot", name=subject.name)
    root.append(ET.Comment(f" {re.sub('-+', '-', heading(subject))} "))
    ET.SubElement(root, "link", name="base")
    joint.carried = None  # a URDF has no inertia of a drive, so that the body has all of it
    mass, centre, about_centre = body(joint)
    inertial = ET.SubElement(ET.SubElement(root, "link", name="link"), "inertial")
    ET.SubElement(inertial, "origin", xyz=" ".join(map(repr, centre)))
    ET.SubElement(inertial, "mass", value=repr(mass))
    moment = repr(about_centre if joint.kind == "hinge" else mass)
    ET.SubElement(inertial, "inertia", ixx=moment, iyy=moment, izz=moment, ixy="0", ixz="0", iyz="0")
    hinge = "revolute" if joint.limits else "continuous"
    made = ET.SubElement(root, "joint", name="joint", type=hinge if joint.kind == "hinge" else "prismatic")
    ET.SubElement(made, "parent", link="base")
    ET.SubElement(made, "child", link="link")
    ET.SubElement(made, "axis", xyz="0 1 0" if joint.kind == "hinge" else "1 0 0")
    ET.SubElement(made, "dynamics", damping=repr(joint.damping), friction=repr(joint.frictionloss))
    low, high = joint.limits or (-FAR, FAR)
    clips = [abs(gain) * one["clip"][1] for gain, one in zip(joint.gains, joint.inputs, strict=True) if "clip" in one]
    effort = sum(clips) if len(clips) == len(joint.gains) else FAR
    ET.SubElement(made, "limit", lower=repr(low), upper=repr(high), effort=repr(effort), velocity=repr(FAR))
    joint_runs.write(root, folder / FILE, subject, joint, _joint)


def run(folder: Path, about: About, record: CheckRecord) -> Float[np.ndarray, "N ny"]:
    """Step MuJoCo, which reads URDF, through the record; the friction hardly gives way, and the step is ours."""
    model, joint = joint_runs.load(file_in(folder, FILE)), joint_runs.read_joint(folder)
    step = about.dt / joint["substeps"]
    model.opt.timestep, model.opt.integrator = step, engine().mjtIntegrator.mjINT_RK4
    impedance = [float(value) for value in joint_runs.STIFF.split()]
    model.dof_solref[:], model.dof_solimp[:] = (2 * step, 1.0), impedance
    model.jnt_solref[:], model.jnt_solimp[:] = (2 * step, 1.0), impedance
    return joint_runs.run(model, joint, about, record, effort=True)
