"""A machine of which something is known: its constants, the controller inside it, and what of them is estimated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from simgap.greybox.effects.effect import Parameter
from simgap.greybox.terms import Term
from simgap.known_plant import Known, KnownPlant
from simgap.records import Channels
from simgap.units import of_motion

# The numbers of a machine in theta, in this order; the gain of the drive follows them.
NAMES = ("inertia", "damping", "back_emf", "mass", "arm", "derivative", "stiffness")
INERTIA, DAMPING, BACK_EMF, MASS, ARM, DERIVATIVE, STIFFNESS = range(len(NAMES))
SUBSTEPS = 2
INF = math.inf
FASTEST = 1.0  # rad in a sample, of a loop that is closed
LESS_DAMPED = (0.1,)  # shares of the damping
FASTER = (1.0, 5.0, 25.0)  # gains of a loop whose command may be limited, beside that of the loop without a limit
SMALL = 1e-3  # share of its usual size that a number near zero counts as


class StandIn(NamedTuple):
    """A number of a machine in the place of an effect; no descent leads from much of the one to much of the other."""

    at: int  # in theta
    factors: tuple[float, ...]  # from which the effect is begun
    stays: bool  # as it is, in the first steps


@dataclass(frozen=True)
class Machine:
    """A driven body whose equation is that of `KnownPlant`, on the columns of u.

    `moment` is the usual m l^2 (or m), `drive` the usual K V e: what a first estimate of the rest starts from.
    """

    known: KnownPlant
    names: tuple[str, ...]  # of the inputs
    units: tuple[str, str]  # of the force or torque, and of the goal or the drive
    moment: float = 0.0
    drive: float = 1.0
    alike: bool = True  # the moment is the same in all records, so that one of an unknown body cannot be told from it

    @cached_property
    def of_drive(self) -> int:
        """The column of the goal, or of the drive."""
        return self.names.index(self.known.input)

    @property
    def controlled(self) -> bool:
        """Whether a position controller is inside."""
        return self.known.controlled

    @property
    def parameters(self) -> list[Parameter]:
        """The numbers of the machine with bounds; what is known is fixed."""
        known = self.known
        absent = {name: Parameter.absent(name) for name in NAMES}
        free = dict.fromkeys(("damping",), 0.0) | ({"back_emf": 0.0} if known.enabled else {})
        if not known.controlled and not known.gravity:
            free["stiffness"] = 0.0
        if known.differentiates:
            free["derivative"] = 0.0
        listed = absent | {name: Parameter(name, "", low, INF) for name, low in free.items()}
        if known.inertia is None:
            told = bool(self.moment) and not (self.alike and not known.gravity)
            fixed = 0.0 if self.moment else 1.0
            listed["inertia"] = Parameter("inertia", "", 0.0, INF) if told else _number("inertia", fixed)
        for name in ("inertia", "damping", "mass", "arm", "derivative"):
            constant: Known | None = getattr(known, name)
            if constant is not None and not constant.column:
                doubted = Parameter(name, "", constant.low, constant.high)
                listed[name] = _number(name, constant.value) if constant.certain else doubted
        return [listed[name] for name in NAMES]

    def start(self) -> Float[np.ndarray, " p"]:
        """Return the numbers that are known, or in the middle of what they may be; the others are zero."""
        values = [getattr(self.known, name, None) for name in NAMES]
        numbers = [0.0 if v is None or v.column else v.value for v in values]
        return np.clip(numbers, [p.low for p in self.parameters], [p.high for p in self.parameters])

    def largest_gain(self, dt: float) -> float:
        """Return the gain of a loop that is faster than any sampling shows; a faster one is as good as infinite."""
        inertia = (self.moment or (self.known.inertia.value if self.known.inertia is not None else 1.0)) or 1.0
        usual = 1.0 if math.isnan(inertia) else inertia
        return usual * self.known.radian * (FASTEST / dt) ** 2 / self.drive if self.controlled else INF

    def shapes(self, theta: Float[np.ndarray, " p"]) -> list[Float[np.ndarray, " 7"]]:
        """List machines of less or more inertia and damping than this one, for fits that may have gone astray."""
        shapes = []
        for inertia, damping in ((1.0, 1.0), (0.3, 1.0), (3.0, 1.0), (1.0, 0.3), (1.0, 3.0)):
            shape = theta[: len(NAMES)].copy()
            shape[INERTIA] *= inertia
            shape[DAMPING : BACK_EMF + 1] *= damping
            shapes.append(np.clip(shape, [p.low for p in self.parameters], [p.high for p in self.parameters]))
        return shapes

    def stand_in(self, term: Term) -> StandIn | None:
        """Tell which number of the machine may have taken the part of an effect that it was fitted without."""
        if term.effect.role == "friction":
            return StandIn(DAMPING, LESS_DAMPED, stays=True)
        if term.effect.port == "input" and term.channel == len(self.names):  # a slow loop for a limit of its command
            return StandIn(len(NAMES), FASTER, stays=False)
        return None

    def column(self, u: Float[np.ndarray, "E T nu"], known: Known | None, other: float) -> Float[np.ndarray, "E T"]:
        """Return a constant over time: a column in SI units, a number, or `other` where it is not known."""
        if known is not None and known.column:
            return known.factor * u[:, :, self.names.index(known.column)]
        return np.full(u.shape[:2], other if known is None else known.value)

    def moments(
        self, u: Float[np.ndarray, "E T nu"], theta: Float[np.ndarray, " p"]
    ) -> tuple[Float[np.ndarray, " E"], Float[np.ndarray, " E"]]:
        """Compute J and m g l of every experiment."""
        known, first = self.known, u[:, :1]
        mass, arm, inertia = (
            self.column(first, constant, 0.0)[:, 0] if constant is not None and constant.column
            else np.full(len(u), theta[i])
            for i, constant in ((MASS, known.mass), (ARM, known.arm), (INERTIA, known.inertia))
        )  # fmt: skip
        moment = mass * arm**2 if known.arm is not None else mass
        return inertia + moment, mass * arm * known.gravity

    def linear(self, theta: Float[np.ndarray, " p"], order: int) -> Float[np.ndarray, "n n"]:
        """Return A of z' = A z of the usual machine with its loop closed, near where it hangs."""
        inertia = (theta[INERTIA] + self.moment) * self.known.radian + 1e-300
        damping = theta[DAMPING] + theta[BACK_EMF] * bool(self.known.enabled)
        if order == 1:
            return np.array([[-damping / inertia]])
        stiffness = theta[STIFFNESS] + (theta[len(NAMES)] * self.drive if self.controlled else 0.0)
        return np.array([[0.0, 1.0], [-stiffness / inertia, -damping / inertia]])

    def sizes(self, theta: Float[np.ndarray, " p"], duration: float, order: int) -> Float[np.ndarray, " p"]:
        """Return the size of each number; one that is near zero has a share of what it would be beside the inertia."""
        inertia, sizes = theta[INERTIA] + self.moment, np.abs(theta)
        rate = max(1.0 / duration, math.sqrt(abs(theta[len(NAMES)]) * self.drive / (inertia + 1e-300)))
        natural = inertia * np.array([1.0, rate, rate, 1.0, 1.0, 0.0, rate * rate])
        natural[DERIVATIVE] = 1.0 / rate
        natural[MASS : ARM + 1] = np.maximum(sizes[MASS : ARM + 1], 1e-12)
        sizes[: len(NAMES)] = np.maximum(sizes[: len(NAMES)], SMALL * natural)
        drive = inertia / (duration**order * self.drive + 1e-300)
        sizes[len(NAMES)] = max(sizes[len(NAMES)], SMALL * drive)
        return sizes


def _number(name: str, value: float) -> Parameter:
    return Parameter(name, "", value, value, fixed=True)


def machine_of(channels: Channels, u: Float[np.ndarray, "E T nu"]) -> Machine:
    """Describe the machine that is known on these columns, as large as in the records u."""
    known = channels.plant
    assert known is not None
    names = tuple(channel.name for channel in channels.inputs)
    unit = channels.inputs[names.index(known.input)].unit
    physical = any(constant is not None for constant in (known.mass, known.inertia))
    force = ("N m" if known.arm is not None or _is_angle(channels) else "N") if physical else ""
    bare = Machine(known, names, (force, unit))
    theta = np.append(bare.start(), 1.0)
    moments, _ = bare.moments(u, theta)
    moments = moments - theta[INERTIA] * (known.inertia is None)
    drive = bare.column(u, known.supply, 1.0) * (bare.column(u, known.gain, 1.0) if known.controlled else 1.0)
    drive = drive[drive > 0] if np.any(drive > 0) else np.ones(1)  # some logs begin before the power is on
    alike = bool(np.ptp(moments) <= 1e-9 * abs(moments).max())
    return Machine(known, names, (force, unit), float(np.median(moments)), float(np.median(drive)), alike)


def _is_angle(channels: Channels) -> bool:
    unit = channels.outputs[0].unit
    return unit in ("tick", "ticks") or of_motion(unit).kind == "angle"
