"""The machines in the field: what each is, and the constants that a seed draws for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from numpy.random import Generator

from simgap.data.simulated.field.kernels import Controller, Machine
from simgap.records import Channel, Channels


@dataclass(frozen=True)
class Plant:
    """A machine with its constants. `scale` is the size of what drives it: of the set points, or of each input."""

    machine: Machine
    controller: Controller
    dt: float  # s
    slowest: float  # s, the time that a delay is measured by
    scale: tuple[float, ...]
    middle: tuple[float, ...]  # set point, or inputs, at the operating point
    channels: Channels


@dataclass(frozen=True)
class Rig:
    """A kind of machine and the effects that can be hidden in it."""

    name: str
    draw: Callable[[Generator], Plant]
    effects: tuple[str, ...]


def log_uniform(rng: Generator, low: float, high: float) -> float:
    """Draw a number that is as likely between 1 and 2 as between 2 and 4."""
    return float(low * (high / low) ** rng.random())


def channels(inputs: tuple[str, ...], output: str, unit: str, kind: str, unit_in: str = "V") -> Channels:
    """Name the columns."""
    return Channels(tuple(Channel(name, unit_in) for name in inputs), (Channel(output, unit, kind),))  # type: ignore[arg-type]


def speed_loop(rng: Generator) -> Plant:
    """Draw a motor that a P or PI controller holds at a moving speed."""
    tau, steady = log_uniform(rng, 0.1, 2.0), log_uniform(rng, 0.5, 3.0)
    kp = rng.uniform(0.7, 3.0) / steady
    ki = kp / (tau * rng.uniform(0.7, 2.0)) * (rng.random() < 0.5)
    size = log_uniform(rng, 0.5, 5.0)
    machine = Machine(measured=1, gain=steady / tau, damping=1 / tau)
    controller = Controller(True, kp, ki, most=8 * size / steady)
    named = channels(("u",), "speed", "rad/s", "velocity")
    return Plant(machine, controller, tau / rng.uniform(6, 15), tau, (size,), (0.0,), named)


def heat_loop(rng: Generator) -> Plant:
    """Draw a heated body of two lags that a PI controller holds at a moving temperature."""
    tau, steady = log_uniform(rng, 20.0, 200.0), log_uniform(rng, 0.3, 2.0)
    second = tau * rng.uniform(0.1, 0.4)
    kp = rng.uniform(0.7, 2.5) / steady
    controller = Controller(True, kp, kp / (tau * rng.uniform(0.8, 2.0)), bias=50.0, most=80.0)
    machine = Machine(True, 2, gain=steady, lag=tau, second=second)
    size = steady * rng.uniform(5.0, 15.0)
    named = channels(("heater",), "temperature", "K", "other", "%")
    return Plant(machine, controller, tau / rng.uniform(8, 15), tau, (size,), (50.0 * steady,), named)


def axis(rng: Generator, closed: bool) -> Plant:
    """Draw an axis without a spring, under PD control or driven by pushes of either sign."""
    damping, gain = log_uniform(rng, 0.5, 8.0), log_uniform(rng, 0.5, 20.0)
    speed = damping * rng.uniform(0.8, 2.5)  # of the closed loop, rad/s
    ratio = rng.uniform(0.7, 1.1)
    machine = Machine(gain=gain, damping=damping)
    kd = max(2 * ratio * speed - damping, 0.0) / gain
    controller = Controller(True, speed**2 / gain, kd=kd) if closed else Controller()
    dt = 1 / (max(damping, speed) * rng.uniform(6, 12))
    named = channels(("u",), "x", "m", "position")
    return Plant(machine, controller, dt, 0.5 / max(damping, speed), (log_uniform(rng, 0.2, 5.0),), (0.0,), named)


def joint(rng: Generator, measured: int) -> Plant:
    """Draw a motor that moves a link through a spring; half of them are held by a spring of their own."""
    swing = log_uniform(rng, 5.0, 50.0)  # rad/s, both against each other
    ratio = log_uniform(rng, 0.3, 3.0)
    spring = swing**2 / (1 + ratio)
    damping = swing / rng.uniform(3, 10)
    stiffness = (swing * rng.uniform(0.1, 0.3)) ** 2 * (rng.random() < 0.5)
    loss = 2 * rng.uniform(0.01, 0.06) * swing / (1 + ratio)
    machine = Machine(
        measured=measured, gain=log_uniform(rng, 0.2, 2.0) * swing**2, damping=damping, stiffness=stiffness,
        spring=spring, loss=loss, ratio=ratio, link_damping=damping * rng.uniform(0.0, 0.1),
    )  # fmt: skip
    named = channels(("u",), "angle", "rad", "position")
    dt = rng.uniform(0.3, 0.8) / swing
    return Plant(machine, Controller(), dt, 1 / damping, (log_uniform(rng, 0.5, 5.0),), (0.0,), named)


def pendulum(rng: Generator) -> Plant:
    """Draw a pendulum; how far it swings is the strength of gravity."""
    swing = log_uniform(rng, 2.0, 8.0)
    machine = Machine(gain=log_uniform(rng, 0.5, 5.0), damping=2 * rng.uniform(0.05, 0.4) * swing, gravity=swing**2)
    named = channels(("torque",), "angle", "rad", "position", "N m")
    size = swing**2 / machine.gain
    return Plant(machine, Controller(), 1 / (swing * rng.uniform(4, 8)), 1 / swing, (size,), (0.0,), named)


def two_forces(rng: Generator) -> Plant:
    """Draw a body on a spring between two drives."""
    swing = log_uniform(rng, 2.0, 20.0)
    gain = log_uniform(rng, 0.3, 3.0) * swing**2
    ratio = rng.uniform(0.4, 1.5) * (1 if rng.random() < 0.5 else -1)
    machine = Machine(gain=gain, gain2=ratio * gain, damping=2 * rng.uniform(0.2, 0.8) * swing, stiffness=swing**2)
    named = channels(("left", "right"), "x", "mm", "position")
    sizes = (log_uniform(rng, 0.5, 5.0), log_uniform(rng, 0.5, 5.0))
    return Plant(machine, Controller(), 1 / (swing * rng.uniform(4, 8)), 1 / swing, sizes, (0.0, 0.0), named)


def heater_fan(rng: Generator) -> Plant:
    """Draw a body that a heater warms and a fan cools."""
    tau, steady = log_uniform(rng, 20.0, 200.0), log_uniform(rng, 0.3, 2.0)
    machine = Machine(True, 0, gain=steady, gain2=-steady * rng.uniform(0.4, 1.2), lag=tau)
    named = channels(("heater", "fan"), "temperature", "K", "other", "%")
    sizes = (rng.uniform(20, 45), rng.uniform(20, 45))
    return Plant(machine, Controller(), tau / rng.uniform(8, 15), tau, sizes, (50.0, 50.0), named)


def valve(rng: Generator, closed: bool) -> Plant:
    """Draw a valve before a slow process of one or two lags, moved by hand or by a PI controller."""
    tau, steady = log_uniform(rng, 5.0, 100.0), log_uniform(rng, 0.3, 2.0)
    second = tau * rng.uniform(0.1, 0.4) * (rng.random() < 0.5)
    machine = Machine(True, 2 if second else 0, gain=steady, lag=tau, second=second)
    kp = rng.uniform(0.5, 1.5) / steady
    controller = Controller(True, kp, kp / (tau * rng.uniform(0.8, 2.0)), bias=50.0, most=80.0)
    size = rng.uniform(8.0, 20.0)
    named = channels(("valve",), "flow", "l/min", "other", "%")
    scale, middle = ((size * steady,), (50.0 * steady,)) if closed else ((size,), (50.0,))
    return Plant(machine, controller if closed else Controller(), tau / rng.uniform(8, 15), tau, scale, middle, named)


RIGS = {
    rig.name: rig
    for rig in (
        Rig("speed_loop", speed_loop, ("coulomb_friction", "input_saturation", "dead_zone", "backlash", "input_delay")),
        Rig("heat_loop", heat_loop, ("input_saturation", "backlash", "input_delay")),
        Rig(
            "axis", lambda rng: axis(rng, True),
            ("coulomb_friction", "constant_load", "input_delay", "dead_zone", "input_saturation"),
        ),
        Rig(
            "axis_open", lambda rng: axis(rng, False),
            ("coulomb_friction", "input_delay", "dead_zone", "input_saturation"),
        ),
        *(
            Rig(
                name, lambda rng, measured=measured: joint(rng, measured),
                ("input_delay", "coulomb_friction", "backlash", "input_saturation", "cubic_stiffness"),
            )
            for name, measured in (("joint_motor", 0), ("joint_link", 2))
        ),
        Rig("pendulum", pendulum, ("gravity", "coulomb_friction", "input_saturation")),
        Rig("two_forces", two_forces, ("input_saturation", "dead_zone", "input_delay", "coulomb_friction")),
        Rig("heater_fan", heater_fan, ("input_saturation", "input_delay", "backlash")),
        *(
            Rig(name, lambda rng, closed=closed: valve(rng, closed), ("valve_stiction", "backlash", "load_drift"))
            for name, closed in (("valve", False), ("valve_loop", True))
        ),
    )
}  # fmt: skip
