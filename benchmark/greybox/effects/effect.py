"""What an effect is: a term of the simulation, its bounded parameters, and the words for it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.scales import SignalScales

Port = Literal["input", "force", "output"]
# What the simulation does with the value of a force term: adds it to the forces; lets dry friction hold up to it; lets
# so much flow out of a tank on top of its linear outflow; lets the tank overflow above it; stops a body there; or lets
# the output return to zero no faster.
Role = Literal["force", "friction", "outflow", "rim", "stop", "braking"]


@dataclass(frozen=True)
class Parameter:
    """One number of an effect, with its unit and its bounds. A fixed one is read off the data and not estimated.

    One that is not `told` is shown in no answer.
    """

    name: str
    unit: str
    low: float
    high: float
    fixed: bool = False
    told: bool = True

    @classmethod
    def absent(cls, name: str) -> Parameter:
        """Return a parameter that an effect has on other plants only; it is zero."""
        return cls(name, "", 0.0, 0.0, fixed=True, told=False)


class Start(NamedTuple):
    """Values that a fit begins with; `amplitude` indexes the parameter that the effect is proportional to, if any."""

    values: tuple[float, ...]
    amplitude: int | None = None


class Effect(ABC):
    """A physical effect, in a file of its own with its laws, which are final; its texts are class attributes."""

    name: ClassVar[str]
    title: ClassVar[str]
    explanation: ClassVar[str]
    reference: ClassVar[str]
    port: ClassVar[Port]
    # The views of the error that show it, the most telling first.
    shows_in: ClassVar[tuple[ViewName, ...]] = ()
    # Effects that data may not tell from this one, and the experiment that would; each pair stands in one file only.
    confounders: ClassVar[dict[str, str]] = {}
    # Simpler effects that this one contains as a special case, and which of its parameters are theirs; it takes their
    # place in a model.
    contains: ClassVar[Mapping[str, tuple[int, ...]]] = {}
    # The same cause as a law with more numbers, of the same name, tried where this one was found.
    refined: ClassVar[type[Effect] | None] = None
    # Each of its starts lies in a valley of its own: the right one is looked for in short pieces.
    many_valleys: ClassVar[bool] = False
    # The states that the term carries through a simulation; the first two of a friction are what the drive carries and
    # what damping takes of it.
    memory: ClassVar[int] = 0
    # They begin anywhere, where those of a force on a body else begin at zero.
    begins_anywhere: ClassVar[bool] = False
    # What the simulation does with the value of a force term.
    role: ClassVar[Role] = "force"
    # Substeps per sample that the term needs.
    substeps: ClassVar[int] = 1
    # Where several effects act on one signal, it passes them in ascending order.
    place_in_chain: ClassVar[int] = 990
    late_place: ClassVar[int | None] = None  # where else it may stand, if the records say so
    # Its parameters belong to one experiment and cannot be forecast.
    per_experiment: ClassVar[bool] = False
    # So many numbers are estimated anew in every experiment: it adds each times one of its `shapes` to the reading, or
    # to the forces.
    own: ClassVar[int] = 0
    # So many of its parameters, the last ones, are those of all experiments nevertheless: its shapes depend on them.
    common: ClassVar[int] = 0
    # With its own numbers it goes on in an experiment as it began, and is as large in all of them.
    repeats: ClassVar[bool] = False
    # The same cause with numbers of its own in every experiment, tried beside it.
    of_each: ClassVar[type[Effect] | None] = None
    # The same cause with the same numbers in all experiments: the law where there are too few of them to fit its own.
    steady: ClassVar[type[Effect] | None] = None
    # It depends on the time since the machine began to run.
    of_time: ClassVar[bool] = False
    # False when it cannot be simulated and is found in the errors instead.
    simulated: ClassVar[bool] = True
    # A linear model of higher order would absorb it, so that it is tried before the nonlinear effects.
    linear: ClassVar[bool] = False
    # A linear model of one order more does the same.
    adds_pole: ClassVar[bool] = False
    # A drive of several masses has it as order or as offset, or does not have the state that it acts on.
    of_one_mass: ClassVar[bool] = False
    # May explain what otherwise asks for a higher order of the plant.
    instead_of_order: ClassVar[bool] = False
    # The linear plant fitted without it has other poles, so that a fit with it searches for the poles anew.
    moves_poles: ClassVar[bool] = False
    may_move_poles_of: ClassVar[tuple[str, ...]] = ()  # kinds of output: a fit to one begins from other poles too
    errors_grow: ClassVar[bool] = False  # with time, so that whole records are hard to fit, and short pieces come first
    # A force over position that stands in the place of the linear spring of a plant of second order.
    replaces_spring: ClassVar[bool] = False
    # The readings alone show it, so that it is tried before anything else.
    visible_in_readings: ClassVar[bool] = False
    # A reading does not tell on which side of zero the quantity is.
    hides_sign: ClassVar[bool] = False
    # It makes steps of what grows evenly: its slope is zero or infinite, and one on average.
    in_steps: ClassVar[bool] = False

    # Functions that the term, or the step, calls.
    helpers: ClassVar[tuple[Callable[..., float], ...]] = ()

    def __eq__(self, other: object) -> bool:
        """Tell whether the other one is the same effect; none has a state."""
        return type(self) is type(other)

    def __hash__(self) -> int:
        return hash(type(self))

    @classmethod
    def laws(cls) -> dict[str, type[Effect]]:
        """Return all laws of this cause, by what they are to it."""
        other = {"refined": cls.refined, "steady": cls.steady, "of_each": cls.of_each}
        return {"effect": cls} | {what: law for what, law in other.items() if law}

    @abstractmethod
    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """List the parameters, with bounds in proportion to the signals."""

    @abstractmethod
    def starts(self, scales: SignalScales) -> list[Start]:
        """List the points from which a fit begins."""

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the effect makes sense on such a plant."""
        return True

    def suits(self, scales: SignalScales) -> bool:
        """Tell whether it makes sense on such a plant and has where to begin."""
        return self.applies_to(scales) and bool(self.starts(scales))

    def as_refined(self, values: np.ndarray) -> np.ndarray | None:
        """Return its numbers as those of the refined law, where that contains it."""
        return None

    def simpler(self, values: np.ndarray, scales: SignalScales) -> Mapping[str, np.ndarray]:
        """Return the laws with fewer numbers that may do as well as this one with these values, with theirs."""
        return {name: values[list(shared)] for name, shared in self.contains.items()}

    def as_spring(self, stiffness: float, scales: SignalScales) -> tuple[float, ...]:
        """Return numbers with which it pulls back as the linear spring does whose place it takes."""
        raise NotImplementedError

    @staticmethod
    def shapes(t: np.ndarray, duration: float, common: np.ndarray) -> np.ndarray:
        """Return what each of its own numbers adds [own, T] at the times t [T] of a record, both in s.

        `common` are those of its parameters that all experiments have in common.
        """
        raise NotImplementedError

    @staticmethod
    def size(own: np.ndarray, added: np.ndarray, measured: np.ndarray) -> np.ndarray:
        """Return the size [E] of its own numbers [E, own], which have added this [E, T] where it was measured."""
        return np.linalg.norm(own, axis=1)

    def describe(self, values: dict[str, float]) -> str:
        """Say what was found in the words of an engineer, with the estimated values."""
        return self.explanation


class InputEffect(Effect):
    """An effect between the commanded input and the input that acts on the plant."""

    port: ClassVar[Port] = "input"
    # Acts on the command c of a controller inside a machine too, compiled: command(c, error, t, h, p, i, m, j).
    on_command: ClassVar[bool] = False
    command: ClassVar[Callable[..., float]]
    # Where in such a machine it may act: on the goal.
    on_goal: ClassVar[bool] = False

    @staticmethod
    @abstractmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Return what arrives of u [E, K], both constant over steps of h seconds; the record starts at rest."""

    @staticmethod
    def term_from(u: np.ndarray, p: np.ndarray, h: float, start: np.ndarray) -> np.ndarray:
        """Return the same for records that start with this in memory, 0 in the middle; for terms that have any."""
        raise NotImplementedError

    @staticmethod
    def term_since(u: np.ndarray, p: np.ndarray, h: float, since: np.ndarray) -> np.ndarray:
        """Return the term of records that begin so many seconds [E] after that, for what depends on this time."""
        raise NotImplementedError

    # For exports, the term for one number after the other, step(u, p, i, m, j, h, k) with k = 0 at the first: its
    # parameters are p[i], p[i + 1], ..., what it keeps m[j], ..., where m[j] begins as the start of `term_from`. A step
    # form, see simgap.step_form.
    step: ClassVar[Callable[..., float]]

    @staticmethod
    def cells(p: np.ndarray, h: float) -> int:
        """Return how many numbers the step keeps."""
        return 0


class ForceEffect(Effect):
    """An effect that acts on the plant together with the input."""

    port: ClassVar[Port] = "force"
    substeps: ClassVar[int] = 4
    # Compiled by the simulator and called once per substep as term(x, v, t, h, p, i, m, j): position x, velocity v,
    # time t and substep h in s; its parameters are p[i], p[i + 1], ..., its states m[j], ...
    term: ClassVar[Callable[..., float]]


class OutputEffect(Effect):
    """An effect between the measured quantity and its reading."""

    port: ClassVar[Port] = "output"

    @staticmethod
    @abstractmethod
    def term(y: np.ndarray, p: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Return the reading of y [E, T] at the times t [T] in s; the record starts at rest.

        For what depends on the time since the machine began to run, t is that, [E, T].
        """

    @staticmethod
    def term_from(y: np.ndarray, p: np.ndarray, t: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Return the same for records that start with this in memory; for terms that have any."""
        raise NotImplementedError

    # The same for one number after the other, as that of an InputEffect; not for what belongs to one experiment.
    step: ClassVar[Callable[..., float]]

    @staticmethod
    def cells(p: np.ndarray, h: float) -> int:
        """Return how many numbers the step keeps."""
        return 0


# Kinds of outputs that tell a motion.
MOTION = ("position", "velocity", "other")
