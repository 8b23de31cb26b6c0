"""A joint of a robot simulator, J x'' = gain u + bias - damping x' - stiffness x - .., and what effects make of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import pi
from typing import Any, Literal

import numpy as np

POINT = 1e-6  # of the inertia: that of a point mass about its centre
STANDARD_GRAVITY = 9.80665  # m/s^2
CANNOT = "this simulator cannot"


@dataclass
class Joint:
    """What a simulator must know of a joint; forces in N m (hinge) or N (slide), positions in rad or m."""

    kind: Literal["hinge", "slide"]
    scale: float  # rad or m in a unit of the output
    inertia: float  # kg m^2 or kg, of all that moves
    force: float  # N m or N in a unit of the model's forces
    damping: float
    stiffness: float
    gains: list[float]  # N m or N per unit of each input
    bias: float = 0.0
    frictionloss: float = 0.0
    drag: float = 0.0  # N m / (rad/s)^2
    stiffness_by_position: list[float] = field(default_factory=lambda: [0.0, 0.0])  # of x and of x^2
    swing: float = 0.0  # m g r, N m
    swing_at: float = 0.0  # rad, where gravity pulls nowhere
    limits: tuple[float, float] | None = None
    inputs: list[dict[str, Any]] = field(default_factory=list)  # of each actuator: clip, lag, delay, reach
    carried: tuple[float, float] | None = None  # kg, m: a known mass on its arm; the rest of the inertia is the drive's
    holds: tuple[float, float] = (0.0, 0.0)  # N m/rad, N m s/rad: what a controller inside makes of position and speed
    rough: bool = False  # our substeps and the simulator's differ in more than rounding


# Effect -> what MuJoCo and URDF call it, the formula, its unit; J inertia, c rad or m in a unit of the output, b gain
# of the plant, other words the parameters of the effect. What has no place there, the simulator cannot.
MJCF: dict[str, tuple[str, str, str]] = {
    "coulomb_friction": ("joint frictionloss", "J c friction force", "N m or N"),
    "constant_load": ("actuator biasprm[0]", "J c force", "N m or N"),
    "quadratic_drag": ("joint damping[1]", "J drag / c", "N m s^2/rad^2"),
    "quadratic_stiffness": ("joint stiffness[1]", "J stiffness / c", "N m/rad^2"),
    "cubic_stiffness": ("joint stiffness[2]", "J stiffness / c^2", "N m/rad^3"),
    "gravity": ("inertial mass and pos, of m g r", "J c amplitude", "N m"),
    "hard_stop": ("joint range", "c (lower, upper end)", "rad or m"),
    "input_saturation": ("actuator ctrlrange", "(-limit, limit)", "unit of the input"),
    "inner_saturation": ("actuator dynprm, forcerange", "time constant; J c b (lower, upper limit)", "s; N m or N"),
    "actuator_lag": ("actuator dyntype filter, dynprm", "time constant", "s"),
    "input_delay": ("actuator delay", "delay", "s"),
    "backlash": ("range of a second joint, of what follows the input", "(-gap / 2, gap / 2)", "unit of the input"),
}
URDF: dict[str, tuple[str, str, str]] = {
    "coulomb_friction": ("dynamics friction", "J c friction force", "N m or N"),
    "gravity": ("inertial mass and origin, of m g r", "J c amplitude", "N m"),
    "hard_stop": ("limit lower, upper", "c (lower, upper end)", "rad or m"),
    "input_saturation": ("limit effort", "J c b limit", "N m or N"),
}


def numbers_of(joint: Joint) -> dict[str, float]:
    """Name the numbers of a joint, in SI units, that a simulation may draw at random."""
    named = {"damping": joint.damping, "stiffness": joint.stiffness, "frictionloss": joint.frictionloss,
             "bias": joint.bias, "drag": joint.drag, "stiffness_x": joint.stiffness_by_position[0],
             "stiffness_x2": joint.stiffness_by_position[1], "swing": joint.swing,
             "armature": armature(joint)}  # fmt: skip
    named |= {f"gain_{i}": gain for i, gain in enumerate(joint.gains)}
    for i, one in enumerate(joint.inputs):
        named |= {f"{name}_{i}": one[name] for name in ("lag", "delay", "gap") if name in one}
        named |= {f"{name}_{i}": one[name][1] for name in ("clip", "reach") if name in one}
    named |= dict(zip(("lower", "upper"), joint.limits or (), strict=False))
    return named


def _friction(joint: Joint, p: list[float], channel: int) -> None:
    joint.frictionloss += joint.force * p[0]


def _load(joint: Joint, p: list[float], channel: int) -> None:
    joint.bias += joint.force * p[0]


def _drag(joint: Joint, p: list[float], channel: int) -> None:
    joint.drag += joint.force / joint.scale**2 * p[0]


def _stiffness(power: int) -> Callable[[Joint, list[float], int], None]:
    def change(joint: Joint, p: list[float], channel: int) -> None:
        joint.stiffness_by_position[power - 1] += joint.force / joint.scale ** (power + 1) * p[0]

    return change


def _gravity(joint: Joint, p: list[float], channel: int) -> None:
    joint.swing, joint.swing_at = joint.force * p[0], p[2] * p[1]


def _stop(joint: Joint, p: list[float], channel: int) -> None:
    joint.limits = joint.scale * p[0], joint.scale * p[1]


def _clip(joint: Joint, p: list[float], channel: int) -> None:
    joint.inputs[channel]["clip"] = (-p[0], p[0])


def _lag(joint: Joint, p: list[float], channel: int) -> None:
    joint.inputs[channel]["lag"] = p[0]


def _inner(joint: Joint, p: list[float], channel: int) -> None:
    ends = sorted(joint.gains[channel] * limit for limit in (p[1], max(p[1], p[2])))
    joint.inputs[channel] |= {"lag": p[0], "reach": tuple(ends)}


def _delay(joint: Joint, p: list[float], channel: int) -> None:
    joint.inputs[channel]["delay"] = p[0]


def _gap(joint: Joint, p: list[float], channel: int) -> None:
    joint.inputs[channel]["gap"] = p[0]


CHANGES: dict[str, Callable[[Joint, list[float], int], None]] = {
    "coulomb_friction": _friction, "constant_load": _load, "quadratic_drag": _drag, "gravity": _gravity,
    "quadratic_stiffness": _stiffness(1), "cubic_stiffness": _stiffness(2), "hard_stop": _stop, "actuator_lag": _lag,
    "input_saturation": _clip, "inner_saturation": _inner, "input_delay": _delay,
    "backlash": _gap,
}  # fmt: skip


def armature(joint: Joint) -> float:
    """Return the inertia of the drive, where the carried mass is known beside it; the body has that of the rest."""
    if joint.carried is None:
        return 0.0
    mass, arm = joint.carried
    return max(joint.inertia * (1 - POINT) - mass * arm**2, 0.0)


def body(joint: Joint) -> tuple[float, tuple[float, float, float], float]:
    """Mass in kg, its centre in m and its inertia about that in kg m^2, for a hinge about y or a slide along x."""
    if joint.kind == "slide":
        return joint.inertia, (0.0, 0.0, 0.0), joint.inertia
    if joint.carried is not None:
        mass, arm = joint.carried
        at = joint.swing_at
        own = POINT * joint.inertia  # a simulator asks for one about the centre
        return mass, (arm * float(np.sin(at)), 0.0, -arm * float(np.cos(at))), own
    if not joint.swing:
        return 1.0, (0.0, 0.0, 0.0), joint.inertia
    moment = abs(joint.swing) / STANDARD_GRAVITY  # m r; half of the inertia is m r^2
    r, angle = joint.inertia / (2 * moment), joint.swing_at + (pi if joint.swing < 0 else 0.0)
    return moment / r, (r * float(np.sin(angle)), 0.0, -r * float(np.cos(angle))), joint.inertia / 2


def effects_table() -> list[str]:
    """Write the table of the README: the effects that either of the two can hold."""
    lines = ["| effect | `mjcf` | `urdf` |", "|---|---|---|"]
    for name in sorted(MJCF):
        cells = [
            f"{there[name][0]} = {there[name][1]} [{there[name][2]}]" if name in there else CANNOT
            for there in (MJCF, URDF)
        ]
        lines.append(f"| `{name}` | {cells[0]} | {cells[1]} |")
    return lines
