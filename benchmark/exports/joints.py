"""Grey boxes as one joint of a robot simulator: J x'' = gain u + bias - damping x' - stiffness x - .., in SI units."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import pi
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from simgap.exports.grey_boxes import GreyBoxStep
from simgap.exports.subjects import CheckRecord, Subject
from simgap.greybox.model import FittedPlant, GreyBoxModel
from simgap.known_plant import ANGLES
from simgap.records import UnusableInput

STANDARD_GRAVITY = 9.81  # m/s^2
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}  # in m, as ANGLES in rad; a velocity's is that per second
CANNOT = "this simulator cannot"
NO_INERTIA = (
    "forces need the inertia of the joint, in kg m^2 or kg, or the torque constant, in N m or N per unit of the first "
    "input; give one as --plant inertia=0.01 or --plant torque_constant=0.05"
)


@dataclass
class Joint:
    """What a simulator must know of a joint; forces in N m (hinge) or N (slide), positions in rad or m."""

    kind: Literal["hinge", "slide"]
    scale: float  # rad or m in a unit of the output
    inertia: float  # kg m^2 or kg
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
    rough: bool = False  # our substeps and the simulator's differ in more than rounding


# Effect -> what MuJoCo and URDF call it, the formula, its unit; J inertia, c rad or m in a unit of the output, b gain
# of the plant, other words the parameters of the effect. What has no place there, the simulator cannot.
MJCF: dict[str, tuple[str, str, str]] = {
    "coulomb_friction": ("joint frictionloss", "J c friction force", "N m or N"),
    "constant_load": ("actuator biasprm[0]", "J c load", "N m or N"),
    "quadratic_drag": ("joint damping[1]", "J drag / c", "N m s^2/rad^2"),
    "quadratic_stiffness": ("joint stiffness[1]", "J stiffness / c", "N m/rad^2"),
    "cubic_stiffness": ("joint stiffness[2]", "J stiffness / c^2", "N m/rad^3"),
    "gravity": ("inertial mass and pos, of m g r", "J c amplitude", "N m"),
    "hard_stop": ("joint range", "c (lower, upper end)", "rad or m"),
    "input_saturation": ("actuator ctrlrange", "(-limit, limit)", "unit of the input"),
    "inner_saturation": ("actuator dynprm, forcerange", "time constant; J c b (lower, upper limit)", "s; N m or N"),
    "actuator_lag": ("actuator dyntype filter, dynprm", "time constant", "s"),
    "input_delay": ("actuator delay", "delay", "s"),
}
URDF: dict[str, tuple[str, str, str]] = {
    "coulomb_friction": ("dynamics friction", "J c friction force", "N m or N"),
    "gravity": ("inertial mass and origin, of m g r", "J c amplitude", "N m"),
    "hard_stop": ("limit lower, upper", "c (lower, upper end)", "rad or m"),
    "input_saturation": ("limit effort", "J c b limit", "N m or N"),
}


def refusal(kind: type) -> str:
    """Say why models of a class are no joint; empty where they may be one."""
    return "" if issubclass(kind, GreyBoxModel) else "only a grey box is a joint with inertia, damping and friction"


def joint_of(subject: Subject, table: Mapping[str, tuple[str, str, str]], simulator: str) -> Joint:
    """Turn a grey box into a joint. Raises UnusableInput for what the simulator cannot hold, and without an inertia."""
    fitted = _single(subject, simulator)
    plant, theta = fitted.forecasting, fitted.estimate.theta
    strange = [term.effect.name for term in plant.terms if term.effect.name not in table]
    if strange:
        able = ", ".join(table)
        raise UnusableInput(f"{simulator} cannot hold {', '.join(strange)}: of the effects, it takes {able}")
    kind, scale = _scale(subject, fitted.outputs[0])
    gains = theta[plant.layout.gains]
    inertia = _inertia(subject.plant, scale * float(gains[0]))
    poles = theta[plant.layout.poles]
    joint = Joint(
        kind, scale, inertia, inertia * float(poles[0]), inertia * float(poles[1]) if plant.order == 2 else 0.0,
        [inertia * scale * float(gain) for gain in gains], inputs=[{} for _ in gains],
    )  # fmt: skip
    if plant.offset:
        joint.bias = inertia * scale * float(theta[plant.layout.offset][0])
    for term in plant.terms:
        CHANGES[term.effect.name](joint, theta[plant.part_of(term)].tolist(), term.channel)
        joint.rough |= term.effect.name not in ("input_saturation", "constant_load")
    return joint


def numbers_of(joint: Joint) -> dict[str, float]:
    """Name the numbers of a joint, in SI units, that a simulation may draw at random."""
    named = {"damping": joint.damping, "stiffness": joint.stiffness, "frictionloss": joint.frictionloss,
             "bias": joint.bias, "drag": joint.drag, "stiffness_x": joint.stiffness_by_position[0],
             "stiffness_x2": joint.stiffness_by_position[1], "swing": joint.swing}  # fmt: skip
    named |= {f"gain_{i}": gain for i, gain in enumerate(joint.gains)}
    for i, one in enumerate(joint.inputs):
        named |= {f"{name}_{i}": one[name] for name in ("lag", "delay") if name in one}
        named |= {f"{name}_{i}": one[name][1] for name in ("clip", "reach") if name in one}
    named |= dict(zip(("lower", "upper"), joint.limits or (), strict=False))
    return named


def _single(subject: Subject, simulator: str) -> FittedPlant:
    fitted, *others = subject.model.plants
    plant = fitted.forecasting
    if others:
        raise UnusableInput(f"{simulator} takes one joint, the model has {1 + len(others)} plants")
    rigid = (plant.kind, plant.order) in (("position", 2), ("velocity", 1)) and not plant.joint
    if not rigid:
        raise UnusableInput(
            f"{simulator} takes a rigid joint, a position of order 2 or a velocity of order 1; this is a plant of kind "
            f"{plant.kind} and order {plant.order}{' with a flexible joint' if plant.joint else ''}"
        )
    if plant.zeros or plant.taps != (0,):
        raise UnusableInput(
            f"{simulator} holds the input between two samples; in this model it runs on to the next one"
        )
    return fitted


def _scale(subject: Subject, output: int) -> tuple[Literal["hinge", "slide"], float]:
    channel = subject.fitted_on.channels.outputs[output]
    unit = channel.unit.strip().removesuffix("/s")
    if unit in ANGLES:
        return "hinge", ANGLES[unit]
    if unit in LENGTHS:
        return "slide", LENGTHS[unit]
    raise UnusableInput(
        f"the unit of {channel.name} is {channel.unit or 'not given'!r}, which is neither an angle nor a length; "
        f"known are {', '.join([*ANGLES, *LENGTHS])}, for a velocity with /s"
    )


def _inertia(plant: Mapping[str, float], gain: float) -> float:
    """J, as it is given or as torque constant = J c b tells it."""
    if plant.get("inertia", 0.0) > 0:
        return float(plant["inertia"])
    if plant.get("torque_constant", 0.0) and gain:
        return abs(float(plant["torque_constant"]) / gain)
    raise UnusableInput(NO_INERTIA)


def _friction(joint: Joint, p: list[float], channel: int) -> None:
    joint.frictionloss += joint.inertia * joint.scale * p[0]


def _load(joint: Joint, p: list[float], channel: int) -> None:
    joint.bias += joint.inertia * joint.scale * p[0]


def _drag(joint: Joint, p: list[float], channel: int) -> None:
    joint.drag += joint.inertia / joint.scale * p[0]


def _stiffness(power: int) -> Callable[[Joint, list[float], int], None]:
    def change(joint: Joint, p: list[float], channel: int) -> None:
        joint.stiffness_by_position[power - 1] += joint.inertia / joint.scale**power * p[0]

    return change


def _gravity(joint: Joint, p: list[float], channel: int) -> None:
    joint.swing, joint.swing_at = joint.inertia * joint.scale * p[0], p[2] * p[1]


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


CHANGES: dict[str, Callable[[Joint, list[float], int], None]] = {
    "coulomb_friction": _friction, "constant_load": _load, "quadratic_drag": _drag, "gravity": _gravity,
    "quadratic_stiffness": _stiffness(1), "cubic_stiffness": _stiffness(2), "hard_stop": _stop, "actuator_lag": _lag,
    "input_saturation": _clip, "inner_saturation": _inner, "input_delay": _delay,
}  # fmt: skip


def body(joint: Joint) -> tuple[float, tuple[float, float, float], float]:
    """Mass in kg, its centre in m and its inertia about that in kg m^2, for a hinge about y or a slide along x."""
    if joint.kind == "slide":
        return joint.inertia, (0.0, 0.0, 0.0), joint.inertia
    if not joint.swing:
        return 1.0, (0.0, 0.0, 0.0), joint.inertia
    moment = abs(joint.swing) / STANDARD_GRAVITY  # m r; half of the inertia is m r^2
    r, angle = joint.inertia / (2 * moment), joint.swing_at + (pi if joint.swing < 0 else 0.0)
    return moment / r, (r * float(np.sin(angle)), 0.0, -r * float(np.cos(angle))), joint.inertia / 2


@dataclass(frozen=True)
class JointStart:
    """Where the joint stands at a row of a record: in rad or m, and per second; where each lag and input stand."""

    row: int
    position: float
    velocity: float
    lags: list[float]


def start_of(subject: Subject, joint: Joint, record: CheckRecord) -> JointStart:
    """Find the start of a record: the last measured row, from which the first simulated one follows."""
    u, row = record.u, max(record.n - 1, 0)
    nu, ny = u.shape[1], record.y_hat.shape[1]
    form = GreyBoxStep(subject.model, nu, ny)
    writer = form.writers[0]
    state = form.form.rest.copy()
    if record.n:
        writer.start(u, record.y_init, state)
    before = form.form.run_on(u[:row], state)[1]
    now = form.form.run_on(u[row : row + 1], before)[1]
    lags = []
    for channel in range(nu):
        terms = [t for t in writer.plant.on("input", channel) if t.effect.name in ("actuator_lag", "inner_saturation")]
        first = np.clip(u[0, channel], *joint.inputs[channel].get("clip", (-np.inf, np.inf)))
        lags.append(float(before[writer.memory[terms[0]]] if terms and row else first))
    z: Float[np.ndarray, " n"] = now[writer.at : writer.at + writer.plant.order] * joint.scale
    position, velocity = (z[0], z[1]) if len(z) == 2 else (0.0, z[0])
    return JointStart(row, float(position), float(velocity), lags)


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
