"""What a search found out about one plant, in the numbers that a diagnosis reports."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simgap.greybox.fitting import Problem
from simgap.greybox.leftover import Leftover, look_for_more
from simgap.greybox.model import Machine
from simgap.greybox.outliers import Outliers
from simgap.greybox.plant import Term
from simgap.greybox.selection import Search
from simgap.greybox.trial import Trial, replaces
from simgap.records import Channels
from simgap.registry import EFFECTS

ENOUGH = 20_000  # samples for a profile; of longer records it is drawn from the excerpts of the search
PROFILE = (-3.0, -2.0, -1.0, -0.5, 0.5, 1.0, 2.0, 3.0)  # half widths of the 95 % interval


@dataclass(frozen=True)
class Number:
    """A parameter with its 95 % interval."""

    name: str
    unit: str
    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Named:
    """An effect of the model: shares of squared errors that it explains, and its parameters."""

    term: Term
    evidence: float
    gain: float
    log_likelihood_ratio: float
    parameters: tuple[Number, ...]


@dataclass(frozen=True)
class Rival:
    """Another effect: the held-out share it would explain, and how far its score stays behind."""

    name: str
    gain: float
    behind: float


@dataclass(frozen=True, eq=False)
class Part:
    """One plant: the search that found its effects, and the machine fitted to all training data."""

    search: Search
    machine: Machine

    @property
    def outputs(self) -> tuple[int, ...]:
        """Which outputs of the data set the plant has."""
        return self.machine.outputs

    @property
    def found(self) -> Trial:
        """The model that the search ended with."""
        return self.search.path[-1]

    @property
    def explained(self) -> float:
        """Share of the plain model's squared error in training that the effects explain together."""
        return 1 - self.found.estimate.squares / self.search.plain_squares

    @cached_property
    def losses(self) -> list[tuple[Term, Trial]]:
        """Every effect with the model that does without it, the most missed first."""
        return self.search.losses(self.found)

    def named(self) -> list[Named]:
        """The effects in the order of what they explain."""
        plain, here = self.search.plain_squares, self.found
        low, high = self.machine.intervals() if here.terms else (np.zeros(0), np.zeros(0))
        named = [self._outlier(found) for found in self.search.outliers]
        for term, without in self.losses:
            evidence = (without.estimate.squares - here.estimate.squares) / plain
            gain = 1 - here.blocks.sum() / max(without.blocks.sum(), 1e-300)
            ratio = here.train - without.train
            if term.effect.obvious:  # seen in the readings, and confirmed by plain squares
                ratio = -0.5 * self.search.train.samples * math.log(here.estimate.squares / without.estimate.squares)
            named.append(Named(term, float(evidence), float(gain), ratio, self._numbers(term, low, high)))
        return named

    def _outlier(self, found: Outliers) -> Named:
        term = Term(EFFECTS["outliers"](), found.output)
        rate, size = term.effect.parameters(self.search.structure.scenes.outputs[found.output])
        reach = 1.96 * math.sqrt(found.rate * (1 - found.rate) / self.search.train.samples)
        wide = 1.96 / math.sqrt(2 * max(1.0, found.rate * self.search.train.samples))
        numbers = (
            Number(rate.name, rate.unit, found.rate, max(0.0, found.rate - reach), found.rate + reach),
            Number(size.name, size.unit, found.size, found.size * (1 - wide), found.size * (1 + wide)),
        )
        return Named(term, found.share, found.share, found.log_likelihood_ratio, numbers)

    def _numbers(self, term: Term, low: np.ndarray, high: np.ndarray) -> tuple[Number, ...]:
        estimate = self.machine.estimate
        structure = estimate.structure
        if term in structure.local:
            parameter = structure.parameters_of(term)[0]
            values = estimate.local[:, structure.order + structure.local.index(term)]
            spread = float(np.sqrt(np.mean(values**2)))
            return (
                Number(f"{parameter.name}, rms over experiments", parameter.unit, spread, float(np.min(np.abs(values))),
                       float(np.max(np.abs(values)))),
            )  # fmt: skip
        at = structure.term_at(term)
        return tuple(
            Number(p.name, p.unit, float(value), float(a), float(b))
            for p, value, a, b in zip(structure.parameters_of(term), estimate.theta[at], low[at], high[at], strict=True)
        )

    def rivals(self, term: Term) -> list[Rival]:
        """What could stand in the place of an effect, the nearest first; the other effects stay."""
        if term.effect.name == "outliers":
            return []
        without = dict(self.losses)[term]
        trials = self.search.round(without.estimate)
        others = []
        for trial in trials:
            new = [t for t in trial.terms if t not in without.terms]
            if (
                new
                and not replaces(new[0], term)
                and new[0].effect.name != term.effect.name
                and self.search.significant(without, trial)
            ):
                gain = 1 - trial.blocks.sum() / max(without.blocks.sum(), 1e-300)
                others.append(Rival(new[0].effect.name, float(gain), self.found.score - trial.score))
        return others

    def runners_up(self) -> list[Rival]:
        """The other effects of the round in which the first one was chosen."""
        taken = set(self.found.names)
        rivals = []
        for here, trials in self.search.rounds:
            if here.terms or len(trials) < 2:
                continue
            rivals = [
                Rival(
                    trial.names[-1],
                    float(1 - trial.blocks.sum() / max(here.blocks.sum(), 1e-300)),
                    trials[0].score - trial.score,
                )
                for trial in trials
                if not taken & set(trial.names) and not any(replaces(trial.terms[-1], t) for t in self.found.terms)
            ]
        return rivals

    def channel(self, term: Term, channels: Channels) -> str:
        """The name of the input or output that an effect sits on; empty for a force."""
        if term.effect.port == "input":
            return channels.inputs[term.channel].name
        return channels.outputs[self.outputs[term.channel]].name if term.effect.port == "output" else ""

    def leftover(self) -> Leftover:
        """What the errors still hold that the input and the motion would predict."""
        return look_for_more(self.found.estimate, self.search.train)

    def profiles(self, term: Term) -> list[tuple[str, str, tuple[float, ...], tuple[float, ...]]]:
        """2 (log L_max - log L) over values of each parameter, everything else fitted anew."""
        few = self.machine.records.samples <= ENOUGH
        estimate, records = (
            (self.machine.estimate, self.machine.records) if few else (self.found.estimate, self.search.train)
        )
        structure = estimate.structure
        if term not in structure.terms or term in structure.local:
            return []
        problem = Problem(structure, records, self.search.base_noise)
        low, high = self.machine.intervals()
        n = records.samples * structure.ny
        drawn = []
        for i, parameter in zip(
            range(*structure.term_at(term).indices(structure.size)), structure.parameters_of(term), strict=True
        ):
            reach = 0.5 * (high[i] - low[i])
            if parameter.fixed or not reach > 0:
                continue
            fixed = np.arange(structure.size) == i
            points = [(float(estimate.theta[i]), 0.0)]
            for step in PROFILE:
                theta = estimate.theta.copy()
                theta[i] = np.clip(theta[i] + step * reach, parameter.low, parameter.high)
                fit = problem.fit(theta, estimate.local, fixed=fixed, max_steps=10)
                points.append((float(theta[i]), n * math.log(fit.squares / estimate.squares)))
            points.sort()
            drawn.append(
                (parameter.name, parameter.unit, tuple(x for x, _ in points), tuple(max(0.0, y) for _, y in points))
            )
        return drawn
