"""A joint and its actuators in the user's own MJCF: only their tags change, and a diff says how."""

from __future__ import annotations

import difflib
import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import degrees
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from simgap.exports.joint_runs import engine
from simgap.exports.joints import Joint, armature
from simgap.records import UnusableInput


@dataclass(frozen=True)
class Robot:
    """The user's file as text, and what MuJoCo makes of it at the joint that is meant."""

    file: Path
    text: str
    joint: str
    inertia: float  # that the bodies bring to the joint, with the others at rest
    kind: str
    timestep: float
    in_degrees: bool

    @classmethod
    def read(cls, file: Path, joint: str) -> Robot:
        """Read the file. Raises UnusableInput where MuJoCo cannot, or where it has no such joint."""
        mujoco = engine()
        if not file.is_file():
            raise UnusableInput(f"--into {file}: there is no such file")
        try:
            model = mujoco.MjModel.from_xml_path(str(file))
        except ValueError as error:
            raise UnusableInput(f"--into {file}: MuJoCo cannot read it: {' '.join(str(error).split())}") from error
        names: list[str] = [model.joint(i).name for i in range(model.njnt)]
        kinds = {int(mujoco.mjtJoint.mjJNT_HINGE): "hinge", int(mujoco.mjtJoint.mjJNT_SLIDE): "slide"}
        simple = [name for i, name in enumerate(names) if name and int(model.jnt_type[i]) in kinds]
        if joint not in simple:
            raise UnusableInput(
                f"--joint {joint}: {file} has no such hinge or slide; it has {', '.join(simple) or 'none'}"
            )
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        masses = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, masses)
        i = names.index(joint)
        dof = int(model.jnt_dofadr[i])
        try:
            text = file.read_text(encoding="utf-8")
        except UnicodeDecodeError as error:
            raise UnusableInput(f"--into {file}: it is not written in UTF-8; save it so") from error
        radians = re.search(r"<compiler\b[^>]*\bangle\s*=\s*[\"']radian", _without_comments(text))
        inertia = float(masses[dof, dof] - model.dof_armature[dof])
        return cls(
            file, text, joint, inertia, kinds[int(model.jnt_type[i])], float(model.opt.timestep), radians is None
        )


def patched(
    robot: Robot, joint: Joint, attributes: Mapping[str, str], actuators: Sequence[Mapping[str, str]], added: ET.Element
) -> tuple[str, str]:
    """Return the patched text and a unified diff; the armature is the inertia that the bodies do not have.

    `added` holds further elements by the sections that they belong to. Raises UnusableInput where the joint is of
    another kind, its bodies are too heavy, or their gravity is their own.
    """
    if joint.kind != robot.kind:
        raise UnusableInput(f"--joint {robot.joint} is a {robot.kind}, the model is one of a {joint.kind}")
    made = {**attributes, "armature": repr(_armature(robot, joint))}
    if joint.limits and robot.in_degrees and joint.kind == "hinge":
        made["range"] = " ".join(repr(degrees(end)) for end in joint.limits)
    text = _edited(robot, made)
    text = _with_actuators(robot, text, actuators)
    for section in added:
        text = _with_elements(robot, text, section)
    names = str(robot.file), f"{robot.file.stem}_patched.xml"
    diff = difflib.unified_diff(robot.text.splitlines(True), text.splitlines(True), *names)
    return text, "".join(diff)


def _armature(robot: Robot, joint: Joint) -> float:
    """What the drive has beside the bodies: known, where the mass that it carried is; else what these lack."""
    if joint.carried is not None:
        return armature(joint)
    if joint.swing:
        raise UnusableInput("--into: the model has gravity of its own, which the bodies in the file bring already")
    missing = joint.inertia - robot.inertia
    if missing < 0:
        raise UnusableInput(
            f"the bodies at {robot.joint} have {robot.inertia:.4g} kg m^2 or kg, more than the {joint.inertia:.4g} of "
            f"the model; correct them or --known"
        )
    return missing


def _without_comments(text: str) -> str:
    """Blank the comments, so that places stay."""
    return re.sub(r"<!--.*?-->", lambda match: " " * len(match[0]), text, flags=re.DOTALL)


def _tags(text: str, name: str, attribute: str, value: str) -> list[re.Match[str]]:
    found = re.finditer(rf"<{name}\b[^>]*>", _without_comments(text))
    wanted = re.compile(rf"\s{attribute}\s*=\s*([\"']){re.escape(value)}\1")
    return [match for match in found if wanted.search(match[0])]


def _edited(robot: Robot, attributes: Mapping[str, str]) -> str:
    places = _tags(robot.text, "(?:joint|freejoint)", "name", robot.joint)
    if len(places) != 1:
        raise UnusableInput(
            f"--joint {robot.joint}: its tag is not in {robot.file} itself, but in a file that it includes"
        )
    tag = robot.text[places[0].start() : places[0].end()]
    for name, value in attributes.items():
        written, count = re.subn(rf"(\s){name}\s*=\s*(\"[^\"]*\"|'[^']*')", rf'\g<1>{name}="{value}"', tag)
        tag = written if count else re.sub(r"\s*(/?>)$", rf' {name}="{value}"\1', tag)
    return robot.text[: places[0].start()] + tag + robot.text[places[0].end() :]


def _with_actuators(robot: Robot, text: str, actuators: Sequence[Mapping[str, str]]) -> str:
    there = _tags(
        text, r"(?:general|motor|position|velocity|intvelocity|damper|cylinder|dcmotor)", "joint", robot.joint
    )
    if len(there) > len(actuators):
        raise UnusableInput(
            f"{robot.file} has {len(there)} actuators at {robot.joint}, the model {len(actuators)} inputs; "
            f"take out the others"
        )
    if any(not match[0].endswith("/>") for match in there):
        raise UnusableInput(f"an actuator at {robot.joint} is no single tag; write it as <motor .. />")
    for match, actuator in reversed(list(zip(there, actuators, strict=False))):  # from the end, so that places stay
        name = re.search(r"\sname\s*=\s*[\"']([^\"']*)", match[0])
        kept = dict(actuator) | ({"name": name[1]} if name else {})
        text = text[: match.start()] + _tag(kept) + text[match.end() :]
    return _at_end_of(robot, text, "actuator", [_tag(actuator) for actuator in actuators[len(there) :]])


def _with_elements(robot: Robot, text: str, section: ET.Element) -> str:
    """Put elements at the end of their section, so that joints that are there keep their places in qpos."""
    bodies = section.tag == "worldbody" and len(section) > 0
    if bodies and (lost := re.search(r"<key\b[^>]*\bqpos\b", _without_comments(text))):
        line = text.count("\n", 0, lost.start()) + 1
        raise UnusableInput(
            f"--into {robot.file}: backlash adds joints, which the key in line {line} does not have; take it out"
        )
    ET.indent(section, level=1)
    return _at_end_of(robot, text, section.tag, [ET.tostring(one, "unicode").rstrip() for one in section])


def _at_end_of(robot: Robot, text: str, section: str, tags: Sequence[str]) -> str:
    """Put tags at the end of a section, which is made where there is none."""
    if not tags:
        return text
    bare, added = _without_comments(text), "".join(f"    {tag}\n" for tag in tags)
    for end, made in ((f"</{section}>", f"{added}  "), ("</mujoco>", f"  <{section}>\n{added}  </{section}>\n")):
        if (at := bare.rfind(end)) >= 0:
            return text[:at] + made.removeprefix("  " if section in end else "") + text[at:]
    raise UnusableInput(f"{robot.file} has no closing </mujoco>")


def _tag(attributes: Mapping[str, Any]) -> str:
    return f"<general {' '.join(f'{name}={quoteattr(value)}' for name, value in attributes.items())}/>"
