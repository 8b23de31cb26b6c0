"""Backlash in MuJoCo, by a second joint: a stem that follows the input, and a follower that it pushes across a gap.

The follower w is held by dry friction against the world and carried along at the ends of the joint between the two: the
play operator. A tendon pulls the joint of the machine with gain w. What pulls at w instead is less than that friction.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, replace

from simgap.exports.joint_runs import STIFF
from simgap.exports.joints import Joint
from simgap.exports.subjects import Subject
from simgap.records import UnusableInput

# In steps of the simulator: how fast the stem follows, and the follower's inertia.
FOLLOWS, HEAVY = 0.5, 30.0
HOLDS = 3.0  # times the largest pull at the follower
GIVES = 1e-3  # of the gap, by which the stem gives way
PULLED = 1e-3  # of the largest input, that the machine's joint moves the end of the tendon if it has no spring


@dataclass(frozen=True)
class Gap:
    """One gap: the input that it is on, its width in units of that, and how the tendon pulls."""

    channel: int
    width: float
    stiffness: float  # of the tendon
    arm: float  # of the machine's joint on the tendon, in units of the input per rad or m
    largest: float  # input


def gaps_of(subject: Subject, joint: Joint) -> tuple[list[Gap], Joint]:
    """List the gaps, and the joint with that part of its spring taken away that the tendons bring.

    Raises UnusableInput where something acts on the input behind the gap, or nothing holds the position.
    """
    found = []
    for i, one in enumerate(joint.inputs):
        if not one.get("gap", 0.0):
            continue
        if joint.bias or "lag" in one or subject.model.plants[0].forecast.plant.kind == "velocity":
            raise UnusableInput("mjcf holds backlash of a position only, without a lag or a constant load beside it")
        largest, reach = (float(abs(ends).max()) for ends in (subject.input_range[:, i], subject.output_range))
        arm = PULLED * largest / ((reach or 1.0) * joint.scale)
        if joint.stiffness > 0:
            arm = min(arm, joint.stiffness / abs(joint.gains[i]))
        arm = arm if joint.gains[i] > 0 else -arm
        found.append(Gap(i, one["gap"], joint.gains[i] / arm, arm, largest))
        joint = replace(joint, stiffness=max(joint.stiffness - joint.gains[i] * arm, 0.0))
    return found, joint


def add_gap(root: ET.Element, gap: Gap, step: float, joint: str, prefix: str = "") -> dict[str, str]:
    """Add stem, follower and tendons to a model; return what drives the stem, as attributes of an actuator.

    `joint` is the name of the machine's joint; `prefix` stands before the names of what is added.
    """
    hold = HOLDS * gap.stiffness * gap.largest
    mass = hold / (FOLLOWS**2 * GIVES * gap.width) * step**2
    spring, damping = mass * (FOLLOWS / step) ** 2, 2 * mass * FOLLOWS / step
    world, soft = root.find("worldbody"), f"{2 * step!r} 1"
    assert world is not None
    names = [f"{prefix}{part}{gap.channel}" for part in ("stem", "follower", "hold", "pull")]
    stem = _slider(world, names[0], mass)
    _slider(
        stem, names[1], HEAVY * gap.stiffness * step**2, limited="true", solimplimit=STIFF, solreflimit=soft,
        range=f"{-0.5 * gap.width!r} {0.5 * gap.width!r}",
    )  # fmt: skip
    tendons = root.find("tendon")
    tendons = ET.SubElement(root, "tendon") if tendons is None else tendons
    rub = ET.SubElement(
        tendons, "fixed", name=names[2], frictionloss=repr(hold), solimpfriction=STIFF, solreffriction=soft
    )
    pull = ET.SubElement(tendons, "fixed", name=names[3], stiffness=repr(gap.stiffness), springlength="0")
    for tendon in (rub, pull):
        for name in names[:2]:
            ET.SubElement(tendon, "joint", joint=name, coef="1")
    ET.SubElement(pull, "joint", joint=joint, coef=repr(-gap.arm))
    return {"joint": names[0], "gainprm": repr(spring), "biastype": "affine", "biasprm": f"0 {-spring!r} {-damping!r}"}


def _slider(parent: ET.Element, name: str, mass: float, **limits: str) -> ET.Element:
    body = ET.SubElement(parent, "body", name=name)
    ET.SubElement(body, "inertial", mass=repr(mass), pos="0 0 0", diaginertia=" ".join([repr(mass)] * 3))
    free = dict.fromkeys(("damping", "stiffness", "frictionloss", "armature"), "0")  # whatever the file's defaults are
    ET.SubElement(body, "joint", {"name": name, "type": "slide", "axis": "1 0 0"} | free | limits)
    return body
