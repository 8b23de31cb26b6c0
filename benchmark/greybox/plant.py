"""What a grey-box model consists of: a linear plant, the effects on it, and the order of its parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate

import numpy as np
from jaxtyping import Bool, Float, Int

from simgap.greybox import machine as machines
from simgap.greybox import two_masses
from simgap.greybox.effects.effect import Effect, InputEffect, Parameter, Start
from simgap.greybox.terms import PlantScales, Term
from simgap.records import Kind

FASTEST_TANK, FASTEST = 5.0, 1e6  # of poles, per sample
SUBSTEPS = 16  # in the fastest time constant; the error of the simulation grows with the square of their length
MAX_TERMS = 5  # that a search may find
MOST_OF_A_MACHINE = 8


@dataclass(frozen=True)
class Layout:
    """Where each part of theta stands. poles: coefficients of the sections of A; gains: of each input and tap."""

    poles: slice
    gains: slice
    offset: slice
    zeros: slice
    velocity: slice  # the scale of a second output that measures the velocity
    terms: tuple[slice, ...]


@dataclass(frozen=True)
class Plant:
    """A linear plant of given order, or a known machine, with the effects on it.

    Companion form (all kinds but level), z = (x, x', ..), the product of sections s^2 + a1 s + a0 and s + a:

        x^(n) + .. + a0 x = b u + d + forces,   y = x + c1 x' + ..   (and, for two outputs, y2 = g x')

    Forces see position x and velocity x'; where y is a velocity, they see y.

    Cascade of tanks (level): x_i' = inflow - a_i x_i, each tank's outflow the next one's inflow, y = x_n.

    A joint (`joint` says which side is measured): two masses of order 4, see `two_masses`; forces act on the motor.

    Order 0, a motion imposed on the machine and the force that it takes: y = b u + c1 b u' + d - forces(u, u'). With
    `by_rate` the input is the rate of that motion x, which begins at zero: y = b x + c1 u + d - forces(x, u).
    """

    kind: Kind
    order: int
    nu: int
    dt: float
    zeros: int = 0
    two_outputs: bool = False
    by_rate: bool = False
    offset: bool = False
    # Which samples of the input act in the interval after sample 0, with one gain each. An input that is held needs
    # just that one; the mean of one that runs on smoothly to the next sample is a combination of those around it.
    # None comes later than the end of the interval, where the next output is read.
    taps: tuple[int, ...] = (0,)
    scales: PlantScales | None = None  # needed as soon as there are terms
    terms: tuple[Term, ...] = ()
    joint: two_masses.Side = ""
    machine: machines.Machine | None = None  # of which something is known; its numbers stand where the poles do

    @property
    def ny(self) -> int:
        """Number of outputs."""
        return 1 + self.two_outputs

    @property
    def input_channels(self) -> Sequence[int]:
        """Where effects of an input act: on each input, or on the goal of a controller and, as nu, on its command."""
        if self.machine is None:
            return range(self.nu)
        return (self.machine.of_drive, self.nu) if self.machine.controlled else (self.machine.of_drive,)

    def takes(self, effect: Effect, channel: int) -> bool:
        """Tell whether an effect may act there: on the goal of a controller few do, on its command those that can.

        The conditions of a known machine differ from run to run, and a drift of each run's own would stand for them.
        """
        if self.swings:
            return not effect.of_one_mass
        if self.machine is None:
            return True
        if not isinstance(effect, InputEffect) or not self.machine.controlled:
            known = bool(self.machine.known.gravity) and effect.replaces_spring
            return not known and not effect.own and effect.role != "braking"
        return effect.on_command if channel == self.nu else effect.on_goal

    @property
    def most_terms(self) -> int:
        """Effects that a search may find: more of a machine whose constants it need not find as well."""
        return MAX_TERMS if self.machine is None else MOST_OF_A_MACHINE

    @property
    def reads_in_steps(self) -> bool:
        """Whether a reading comes in steps."""
        return any(term.effect.in_steps for term in self.terms)

    @property
    def sign_hidden(self) -> bool:
        """Whether a reading does not tell on which side of zero it is."""
        return any(term.effect.hides_sign for term in self.terms)

    @property
    def imposed(self) -> bool:
        """Whether the first input is a motion and the output the force that it takes, without dynamics."""
        return self.order == 0

    @property
    def swings(self) -> bool:
        """Whether the velocity is that of a drive of several masses: forces act where the input does, and see y."""
        return self.kind == "velocity" and self.order > 1

    @property
    def force_order(self) -> int:
        """The derivative of the position, or of the output, that forces change."""
        return 2 if self.joint else self.order

    @property
    def cascade(self) -> bool:
        """Whether the states are the levels of tanks in a row."""
        return self.kind == "level"

    def having(self, terms: Sequence[Term]) -> Plant:
        """Return the same plant with these terms, in the order in which signals pass them."""
        return replace(self, terms=tuple(sorted(terms, key=lambda term: (term.place, term.key))))

    @cached_property
    def layout(self) -> Layout:
        """Where each part of theta stands."""
        poles = two_masses.WIDTH if self.joint else len(machines.NAMES) if self.machine else self.order
        gains = 1 if self.machine else self.nu * len(self.taps)
        widths = [poles, gains, int(self.offset), self.zeros, int(self.two_outputs)]
        widths += [len(self.common_of(t)) for t in self.terms]
        slices = [slice(end - width, end) for width, end in zip(widths, accumulate(widths), strict=True)]
        return Layout(*slices[:5], terms=tuple(slices[5:]))

    @property
    def n_linear(self) -> int:
        """Parameters of the linear plant, without its terms."""
        return self.layout.velocity.stop

    @property
    def size(self) -> int:
        """Length of theta."""
        return self.layout.terms[-1].stop if self.terms else self.n_linear

    def parameters_of(self, term: Term) -> tuple[Parameter, ...]:
        """List the parameters of a term, with bounds."""
        assert self.scales is not None
        return term.effect.parameters(self.scales.of(term))

    def common_of(self, term: Term) -> tuple[Parameter, ...]:
        """List those that all experiments have in common, which stand in theta."""
        parameters, effect = self.parameters_of(term), term.effect
        return parameters[len(parameters) - effect.common :] if effect.own else parameters

    def starts_of(self, term: Term) -> list[Start]:
        """List the points from which a fit of a term begins."""
        assert self.scales is not None
        return term.effect.starts(self.scales.of(term))

    def part_of(self, term: Term) -> slice:
        """Return where the parameters of a term that all experiments have in common stand in theta."""
        return self.layout.terms[self.terms.index(term)]

    @cached_property
    def per_experiment(self) -> tuple[Term, ...]:
        """Terms whose parameters are estimated anew in every experiment, those that move the states first."""
        return tuple(sorted((t for t in self.terms if t.effect.own), key=lambda t: t.effect.port == "output"))

    @property
    def n_start(self) -> int:
        """Length of the initial state: that of the plant, then one number for what each term remembers."""
        return self.order + len(self.remembered)

    @cached_property
    def remembered(self) -> tuple[Term, ...]:
        """The terms in an unknown state at the start, in the order in which signals pass them.

        A known machine begins at rest.
        """
        found = [term for term in self.terms if term.effect.memory and term.effect.role != "friction"]
        inputs = [term for term in found if term.effect.port == "input"]
        if self.machine is not None:
            return tuple(term for term in inputs if not term.effect.linear)
        forces = [term for term in found if term.effect.port == "force"]
        sensors = [term for term in found if term.effect.port == "output"]
        return (*inputs, *(term for term in forces if self.imposed or term.effect.begins_anywhere), *sensors)

    def start_of(self, term: Term) -> int:
        """Return where the number that a term remembers stands in the initial state."""
        return self.order + self.remembered.index(term)

    @cached_property
    def n_moving(self) -> int:
        """Numbers of an experiment that move its states: the initial state, then the forces of its own."""
        return self.n_start + sum(term.effect.own for term in self.per_experiment if term.effect.port == "force")

    @property
    def n_local(self) -> int:
        """Numbers estimated in every experiment: the initial state, then those of its own terms."""
        return self.n_start + self.n_own

    @property
    def n_own(self) -> int:
        """Numbers of an experiment that belong to its own terms."""
        return sum(term.effect.own for term in self.per_experiment)

    @property
    def n_of_terms(self) -> int:
        """Numbers of an experiment that its terms ask for: their own, and where what they remember begins."""
        return self.n_own + len(self.remembered)

    def own_part_of(self, term: Term) -> slice:
        """Return where the numbers of a per-experiment term stand among those of an experiment."""
        before = self.per_experiment[: self.per_experiment.index(term)]
        start = self.n_start + sum(other.effect.own for other in before)
        return slice(start, start + term.effect.own)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """All of theta with bounds; those of the linear plant only as far as stability needs them."""
        inf = float("inf")
        # A tank that is much faster than the sampling is no tank; of anything else, no speed would show.
        fastest = (FASTEST_TANK if self.cascade else FASTEST) / self.dt
        squared = [not self.cascade and i % 2 == 1 for i in range(self.order)]  # the a0 of each s^2 + a1 s + a0
        powers = two_masses.POWERS if self.joint else [1 + square for square in squared]
        linear = [Parameter(f"a{i}", "", 0.0, fastest**power) for i, power in enumerate(powers)]
        if self.machine is not None:
            linear = self.machine.parameters
            if any(term.effect.replaces_spring for term in self.terms):
                linear[machines.STIFFNESS] = Parameter.absent("stiffness")
        elif (self.order == 2 or self.joint) and any(term.effect.replaces_spring for term in self.terms):
            linear[1] = Parameter("a1", "", 0.0, 0.0, fixed=True)
        largest = self.machine.largest_gain(self.dt) if self.machine is not None else inf
        linear += [
            Parameter(f"b{i}", "", -largest, largest) for i in range(self.layout.gains.stop - self.layout.gains.start)
        ]
        linear += [Parameter("d", "", -inf, inf)] * self.offset
        linear += [Parameter(f"c{i + 1}", "", -inf, inf) for i in range(self.zeros)]
        linear += [Parameter("g", "", -inf, inf)] * self.two_outputs
        of_terms = [p for t in self.terms for p in self.common_of(t)]
        return (*linear, *of_terms)

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
    def moves_states(self) -> Bool[np.ndarray, " p"]:
        """Which of theta the states depend on: not what only the readings do."""
        moves = np.ones(self.size, dtype=bool)
        readings = [self.part_of(term) for term in self.terms if term.effect.port == "output"]
        for part in (*([] if self.swings else [self.layout.zeros]), self.layout.velocity, *readings):
            moves[part] = False
        return moves

    def carry(
        self, smaller: Plant, theta: np.ndarray, local: np.ndarray
    ) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, "E q"]]:
        """Return theta and the per-experiment numbers of another choice of terms in this plant's layout; else zero."""
        carried = np.zeros(self.size)
        carried[: self.n_linear] = theta[: self.n_linear]
        numbers = np.zeros((len(local), self.n_local))
        if self.order == smaller.order:
            numbers[:, : self.order] = local[:, : self.order]
        for term in self.remembered:
            if term in smaller.remembered:
                numbers[:, self.start_of(term)] = local[:, smaller.start_of(term)]
        for term in (one for one in self.terms if one in smaller.terms):
            carried[self.part_of(term)] = theta[smaller.part_of(term)]
            if term in self.per_experiment:
                numbers[:, self.own_part_of(term)] = local[:, smaller.own_part_of(term)]
        return carried, numbers

    @cached_property
    def of_all(self) -> Plant:
        """The plant without what belongs to single experiments and cannot be forecast."""
        return self.having([term for term in self.terms if term not in self.per_experiment])

    def places_in(self, larger: Plant) -> Int[np.ndarray, " p"]:
        """Return where each of theta stands in that of a plant that has these terms and more."""
        numbered = np.arange(larger.size, dtype=float)
        return self.carry(larger, numbered, np.empty((0, larger.n_local)))[0].astype(int)

    def on(self, port: str, channel: int = 0) -> list[Term]:
        """List the terms of a port, on one channel where it has several, in their order."""
        return [t for t in self.terms if t.effect.port == port and (port == "force" or t.channel == channel)]

    @cached_property
    def substeps(self) -> int:
        """Substeps per sample: what the most demanding term asks for, or fewer where the plant is slow."""
        if self.machine is not None:
            return machines.SUBSTEPS
        if self.imposed:
            return 1
        asked = max((term.effect.substeps for term in self.terms), default=1)
        enough = SUBSTEPS * self.scales.fastest * self.dt if self.scales else math.inf
        return max(1, math.ceil(min(asked, enough)))
