"""Grey boxes as a joint of a robot simulator, linear plants with their effects and machines with a table [plant]."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float

from simgap.exports.grey_boxes import GreyBoxStep
from simgap.exports.joints import CHANGES, Joint
from simgap.exports.subjects import CheckRecord, Subject, step_of, usual_inputs
from simgap.greybox.machine import ARM, BACK_EMF, DAMPING, DERIVATIVE, STIFFNESS
from simgap.greybox.model import FittedPlant, GreyBoxModel
from simgap.greybox.plant import Plant
from simgap.records import UnusableInput
from simgap.units import of_motion

NO_INERTIA = (
    "forces need the inertia of the joint, in kg m^2 or kg, or the torque constant, in N m or N per unit of the first "
    "input; give --known inertia=0.01, or mass=0.5kg with arm=0.1m, or torque_constant=0.05"
)


def refusal(kind: type) -> str:
    """Say why models of a class are no joint; empty where they may be one."""
    return "" if issubclass(kind, GreyBoxModel) else "only a grey box is a joint with inertia, damping and friction"


def joint_of(subject: Subject, table: Mapping[str, tuple[str, str, str]], simulator: str) -> Joint:
    """Turn a grey box into a joint. Raises UnusableInput for what the simulator cannot hold, and without an inertia."""
    fitted = _single(subject, simulator)
    plant, theta = fitted.forecast.plant, fitted.forecast.theta
    strange = [term.effect.name for term in plant.terms if term.effect.name not in table]
    if strange:
        able = ", ".join(table)
        raise UnusableInput(f"{simulator} cannot hold {', '.join(strange)}: of the effects, it takes {able}")
    joint = _of_machine(subject, fitted) if plant.machine is not None else _of_poles(subject, fitted)
    driving = drives(plant)
    for term in plant.terms:
        p = theta[plant.part_of(term)].tolist()
        if term.effect.port != "input" or term.channel in driving:
            CHANGES[term.effect.name](joint, p, driving.index(term.channel) if term.effect.port == "input" else 0)
        joint.rough |= term.effect.name not in ("input_saturation", "constant_load")
    return joint


def drives(plant: Plant) -> Sequence[int]:
    """List the inputs that drive the joint: all of a linear plant, the goal or the drive of a machine."""
    return range(plant.nu) if plant.machine is None else (plant.machine.of_drive,)


def steady(subject: Subject) -> Subject:
    """Hold the columns of a machine that no joint has, such as its supply, at the middle of each record."""
    fitted = subject.model.plants[0] if isinstance(subject.model, GreyBoxModel) else None
    if fitted is None or fitted.forecast.plant.machine is None:
        return subject
    return replace(subject, records=tuple(_steady(subject, one) for one in subject.records))


def _steady(subject: Subject, record: CheckRecord) -> CheckRecord:
    driving = drives(subject.model.plants[0].forecast.plant)
    u = np.tile(usual_inputs(subject.model, record.u), (len(record.u), 1))
    u[:, driving] = record.u[:, driving]
    if not record.n:
        return replace(record, u=u)
    y_hat = subject.model.simulate(u[None], record.y_init[None])[0]
    start = step_of(subject.name, subject.model, subject.fitted_on)[1](u, record.y_init)
    return replace(record, u=u, y_hat=y_hat, start=start)


def _of_poles(subject: Subject, fitted: FittedPlant) -> Joint:
    plant, theta = fitted.forecast.plant, fitted.forecast.theta
    kind, scale = _scale(subject, fitted.outputs[0])
    gains, poles = theta[plant.layout.gains], theta[plant.layout.poles]
    inertia = _inertia(subject.known, scale * float(gains[0]))
    force = inertia * scale
    joint = Joint(
        kind, scale, inertia, force, inertia * float(poles[0]), inertia * float(poles[1]) if plant.order == 2 else 0.0,
        [force * float(gain) for gain in gains], inputs=[{} for _ in gains],
    )  # fmt: skip
    if plant.offset:
        joint.bias = force * float(theta[plant.layout.offset][0])
    return joint


def _of_machine(subject: Subject, fitted: FittedPlant) -> Joint:
    """A machine as it is in the first record: its columns have the value that they have there in the middle."""
    plant, theta = fitted.forecast.plant, fitted.forecast.theta
    machine = plant.machine
    assert machine is not None
    if not machine.units[0]:
        raise UnusableInput(
            "the table [plant] of this machine has neither mass nor inertia, so that its forces have no unit; "
            "give one in the table and fit again"
        )
    known, row = machine.known, usual_inputs(subject.model, subject.records[0].u)[None, None]
    inertias, weights = machine.moments(row, theta)
    supply = float(machine.column(row, known.supply, 1.0)[0, 0])
    strength = float(theta[plant.layout.gains.start]) * supply
    gain = strength
    if known.controlled:
        gain *= float(machine.column(row, known.gain, 1.0)[0, 0]) * known.goal_factor
    damping = float(theta[DAMPING]) + float(theta[BACK_EMF]) * bool(known.enabled)
    scale = known.radian
    joint = Joint(
        "hinge" if machine.units[0] == "N m" else "slide", scale, float(inertias[0]), 1.0, damping / scale,
        float(theta[STIFFNESS]) / scale, [gain], inputs=[{}], rough=True,
    )  # fmt: skip
    if known.controlled:
        joint.holds = gain / known.goal_factor / scale, strength * float(theta[DERIVATIVE]) / scale
    for term in plant.on("input", plant.nu):  # of what limits a command, the table holds the saturation only
        reach = abs(strength) * float(theta[plant.part_of(term)][0])
        joint.inputs[0]["reach"] = (-reach, reach)
    if known.gravity:
        joint.swing, joint.swing_at = float(weights[0]), known.hangs_at * scale
        in_column = known.arm is not None and known.arm.column
        arm = float(machine.column(row, known.arm, 0.0)[0, 0] if in_column else theta[ARM])
        joint.carried = joint.swing / known.gravity / arm, arm
    return joint


def _single(subject: Subject, simulator: str) -> FittedPlant:
    fitted, *others = subject.model.plants
    plant = fitted.forecast.plant
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
    motion = of_motion(channel.unit)
    if not motion.kind:
        raise UnusableInput(
            f"the unit of {channel.name} is {channel.unit or 'not given'!r}, which is neither an angle nor a length; "
            "write one, such as deg, mm, rad/s or rpm"
        )
    return "hinge" if motion.kind == "angle" else "slide", motion.factor


def _inertia(known: Mapping[str, float], gain: float) -> float:
    """J, as it is given or as torque constant = J c b tells it."""
    if known.get("inertia", 0.0) > 0:
        return float(known["inertia"])
    if known.get("torque_constant", 0.0) and gain:
        return abs(float(known["torque_constant"]) / gain)
    raise UnusableInput(NO_INERTIA)


@dataclass(frozen=True)
class JointStart:
    """Where a joint stands at a row of a record: in rad or m, and per second; where its lags and followers stand."""

    row: int
    position: float
    velocity: float
    lags: list[float]
    followers: list[float]  # behind a gap, in units of the input


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
    lags, followers = [], []
    for i, channel in enumerate(drives(writer.plant)):
        terms = [t for t in writer.plant.on("input", channel) if t.effect.name in ("actuator_lag", "inner_saturation")]
        first = np.clip(u[0, channel], *joint.inputs[i].get("clip", (-np.inf, np.inf)))
        lags.append(float(before[writer.memory[terms[0]]] if terms and row else first))
        for term in writer.plant.on("input", channel):
            if term.effect.name == "backlash":
                at = float(before[writer.memory[term]])
                followers.append(at if row else float(u[0, channel]) + 0.5 * joint.inputs[i].get("gap", 0.0) * at)
    z: Float[np.ndarray, " n"] = now[writer.at : writer.at + writer.plant.order] * joint.scale
    position, velocity = (z[0], z[1]) if len(z) == 2 else (0.0, z[0])
    return JointStart(row, float(position), float(velocity), lags, followers)
