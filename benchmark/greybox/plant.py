"""What a grey-box model consists of: a linear plant, the effects on it, and the order of its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate

import numpy as np
from jaxtyping import Bool, Float

from simgap.greybox.effects.effect import Effect, ForceEffect, Parameter, Scene, Start
from simgap.records import Kind

# Where two input effects, or two output effects, meet: the order in which a signal passes them.
INPUT_CHAIN = (
    "input_delay", "gain_fade", "asymmetric_gain", "dead_zone", "input_saturation", "backlash", "actuator_lag",
)  # fmt: skip
OUTPUT_CHAIN = ("sensor_lag", "absolute_sensor", "sensor_saturation", "quantisation", "outliers")
# Added to the reading of one experiment: time to this power.
LOCAL_POWERS = {"sensor_bias": 0, "sensor_drift": 1}


@dataclass(frozen=True, eq=False)
class Scenes:
    """The sizes that each input sees, and each output; forces see those of the first of both."""

    inputs: tuple[Scene, ...]
    outputs: tuple[Scene, ...]

    def of(self, term: Term) -> Scene:
        """What a term sees."""
        port = term.effect.port
        return self.inputs[term.channel] if port == "input" else self.outputs[term.channel if port == "output" else 0]


@dataclass(frozen=True)
class Term:
    """An effect at its place: on which input, or on which output."""

    effect: Effect
    channel: int = 0

    @property
    def key(self) -> tuple[str, int]:
        """Name and channel; a model has each term once."""
        return self.effect.name, self.channel


@dataclass(frozen=True)
class Structure:
    """A plant of given order with its terms; theta is shape, gains, offset, zeros, velocity scale, then the terms.

    Companion form (all kinds but level), z = (x, x', ..), the product of sections s^2 + a1 s + a0 and s + a:

        x^(n) + .. + a0 x = b u + d + forces,   y = x + c1 x' + ..   (and, for two outputs, y2 = g x')

    Cascade of tanks (level): x_i' = inflow - a_i x_i, each tank's outflow the next one's inflow, y = x_n.
    """

    kind: Kind
    order: int
    nu: int
    dt: float
    zeros: int = 0
    two_outputs: bool = False
    offset: bool = False
    # Which samples of the input act in the interval after sample 0, with one gain each. An input that is held needs
    # just that one; the mean of one that runs on smoothly to the next sample is a combination of those around it.
    # None comes later than the end of the interval, where the next output is read.
    taps: tuple[int, ...] = (0,)
    scenes: Scenes = None  # type: ignore[assignment]  # needed as soon as there are terms
    terms: tuple[Term, ...] = ()

    @property
    def ny(self) -> int:
        """Outputs."""
        return 1 + self.two_outputs

    @property
    def signless(self) -> bool:
        """Whether a reading does not tell on which side of zero it is."""
        return any(term.effect.name == "absolute_sensor" for term in self.terms)

    @property
    def cascade(self) -> bool:
        """Whether the states are the levels of tanks in a row."""
        return self.kind == "level"

    def having(self, terms: Sequence[Term]) -> Structure:
        """The same plant with these terms, in the order in which signals pass them."""
        rank = {name: i for i, name in enumerate((*INPUT_CHAIN, *OUTPUT_CHAIN))}
        return replace(self, terms=tuple(sorted(terms, key=lambda term: (rank.get(term.effect.name, 99), term.key))))

    @cached_property
    def widths(self) -> tuple[int, ...]:
        """Sizes of the parts of theta."""
        plant = (self.order, self.nu * len(self.taps), int(self.offset), self.zeros, int(self.two_outputs))
        return plant + tuple(0 if t in self.local else len(self.parameters_of(t)) for t in self.terms)

    @cached_property
    def at(self) -> tuple[slice, ...]:
        """The parts of theta: shape, gains, offset, zeros, velocity scale, then one for each term."""
        ends = tuple(accumulate(self.widths))
        return tuple(slice(end - width, end) for width, end in zip(self.widths, ends, strict=True))

    @property
    def n_plant(self) -> int:
        """Parameters of the plant without its terms."""
        return sum(self.widths[:5])

    @property
    def size(self) -> int:
        """Length of theta."""
        return sum(self.widths)

    def parameters_of(self, term: Term) -> tuple[Parameter, ...]:
        """The parameters of a term, with bounds."""
        return term.effect.parameters(self.scenes.of(term))

    def starts_of(self, term: Term) -> list[Start]:
        """Where a search for a term may begin."""
        return term.effect.starts(self.scenes.of(term))

    def term_at(self, term: Term) -> slice:
        """Where the parameters of a term stand in theta."""
        return self.at[5 + self.terms.index(term)]

    @cached_property
    def local(self) -> tuple[Term, ...]:
        """Terms whose parameters are estimated anew in every experiment."""
        return tuple(term for term in self.terms if term.effect.name in LOCAL_POWERS)

    @property
    def n_local(self) -> int:
        """Numbers estimated in every experiment: the start state, then one for each local term."""
        return self.order + len(self.local)

    def on(self, port: str, channel: int = 0) -> list[Term]:
        """The terms of a port, on one channel where it has several, in their order."""
        return [t for t in self.terms if t.effect.port == port and (port == "force" or t.channel == channel)]

    @cached_property
    def substeps(self) -> int:
        """Substeps a sample: what the most demanding term asks for."""
        return max((term.effect.substeps for term in self.terms), default=1)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """All of theta with bounds; those of the plant only as far as stability needs them."""
        inf = float("inf")
        # A tank that is much faster than the sampling is no tank.
        plant = [Parameter(f"a{i}", "", 0.0, 5 / self.dt if self.cascade else inf) for i in range(self.order)]
        plant += [Parameter(f"b{i}", "", -inf, inf) for i in range(self.widths[1])]
        plant += [Parameter("d", "", -inf, inf)] * self.offset
        plant += [Parameter(f"c{i + 1}", "", -inf, inf) for i in range(self.zeros)]
        plant += [Parameter("g", "", -inf, inf)] * self.two_outputs
        for term in self.terms:
            if term not in self.local:
                plant += self.parameters_of(term)
        return tuple(plant)

    @property
    def low(self) -> Float[np.ndarray, " p"]:
        """Lower bounds of theta."""
        return np.array([parameter.low for parameter in self.parameters])

    @property
    def high(self) -> Float[np.ndarray, " p"]:
        """Upper bounds of theta."""
        return np.array([parameter.high for parameter in self.parameters])

    @property
    def free(self) -> Bool[np.ndarray, " p"]:
        """Which of theta are estimated."""
        return np.array([not parameter.fixed for parameter in self.parameters], dtype=bool)

    @cached_property
    def acting(self) -> Bool[np.ndarray, " p"]:
        """Which of theta the states depend on: not what only the readings do."""
        acting = np.ones(self.size, dtype=bool)
        for part in (*self.at[3:5], *(self.term_at(term) for term in self.terms if term.effect.port == "output")):
            acting[part] = False
        return acting

    def matrix(self, theta: Float[np.ndarray, " p"]) -> Float[np.ndarray, "n n"]:
        """A of z' = A z + (inputs and forces)."""
        shape, n = theta[self.at[0]], self.order
        if self.cascade:
            return np.diag(-shape) + np.diag(shape[:-1], -1)
        polynomial = np.ones(1)
        for first in range(0, n, 2):
            section = [1.0, *shape[first : first + 2]]
            polynomial = np.convolve(polynomial, section)
        a = np.diag(np.ones(n - 1), 1)
        a[-1] = -polynomial[:0:-1]
        return a

    def reading(self, theta: Float[np.ndarray, " p"]) -> Float[np.ndarray, "ny n"]:
        """C of y = C z, before the sensors' effects."""
        c = np.zeros((self.ny, self.order))
        if self.cascade:
            c[0, -1] = 1.0
            return c
        c[0, 0] = 1.0
        c[0, 1 : 1 + self.zeros] = theta[self.at[3]]
        if self.two_outputs:
            c[1, 1] = theta[self.at[4]][0]
        return c

    def forces(self) -> list[Term]:
        """The terms that act in the plant."""
        return [term for term in self.terms if isinstance(term.effect, ForceEffect)]
