"""What an output is where nobody says it: the kind of plant that, with its best effect, the records speak for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simgap.greybox.additions import Extended, extend, with_any_more
from simgap.greybox.baseline import Baseline
from simgap.greybox.effects.effect import Effect
from simgap.greybox.fitting import Estimate
from simgap.greybox.linear import find_baseline
from simgap.greybox.noise import schwarz_order
from simgap.greybox.position_and_velocity import with_kind
from simgap.greybox.score_test import candidates
from simgap.greybox.terms import Term
from simgap.greybox.trial import MATTERS, Trial, assess, holds_out, ranked, significant
from simgap.records import Channels, Kind, TrainingSet

# Two kinds whose scores (log-likelihood, less what the parameters cost) differ by less are not told apart.
ALIKE = 6.0
# Of the spread of a signal: what noise takes a level, or the flow into a tank, below zero.
BELOW_ZERO = 0.1


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """An output taken as of one kind: its plain model, and that model with one effect added."""

    kind: Kind
    baseline: Baseline
    larger: tuple[Estimate, ...] = ()
    extended: Extended | None = None  # what a selection need not fit again

    def judged(self, judge: Baseline, noise_order: int) -> Standing:
        """Find its best model: the plain one, or one with an effect that noise would not do as well as."""
        plain, *larger = (assess(judge, fit, noise_order) for fit in (self.baseline.estimate, *self.larger))
        better = ranked([trial for trial in larger if significant(judge, plain, trial)])
        return Standing(self, better[0] if better else plain)


@dataclass(frozen=True, eq=False)
class Standing:
    """How well a hypothesis does with its best model, on records and noise that are the same for all."""

    hypothesis: Hypothesis
    trial: Trial

    @property
    def lead(self) -> Effect | None:
        """The effect that the records ask for first if the output is of this kind."""
        return self.trial.terms[-1].effect if self.trial.terms else None

    def beats(self, other: Standing, judge: Baseline) -> bool:
        """Tell whether the records speak against the other one: held-out free runs decide, else the score does.

        An effect is named only where no plain model does as well, so that it must beat such a one by its score too.
        """
        mine, its = self.trial, other.trial
        likelier = mine.score > its.score + ALIKE and not _fit_alike(mine.estimate, its.estimate)
        if _simulates_better(mine, its, judge):
            return likelier or self.lead is None or other.lead is not None
        return likelier and not _simulates_better(its, mine, judge)


def _fit_alike(one: Estimate, other: Estimate) -> bool:
    squares = [float(np.sum(fit.errors**2)) for fit in (one, other)]
    return max(squares) - min(squares) < MATTERS * max(squares)


def _simulates_better(one: Trial, other: Trial, judge: Baseline) -> bool:
    matters = other.blocks.sum() - one.blocks.sum() > MATTERS * other.blocks.sum()
    return bool(matters and holds_out(judge, other, one))


@dataclass(frozen=True, eq=False)
class Settled:
    """What an output is taken for, and what else it may be that would have another name: kinds with their effects."""

    kind: Kind
    baseline: Baseline
    extended: Extended
    rivals: tuple[tuple[Kind, Effect], ...] = ()
    as_well: tuple[Kind, ...] = ()  # kinds that do as well and lead to the same


def settle(data: TrainingSet, channels: Channels, output: int) -> Settled:
    """Decide by the records what an output is: each kind's plain model and one effect, against each other.

    Of the kinds that the records do not speak against, the simplest model is taken. A plain one makes the effects of
    other kinds needless; where that is the one of `other`, nothing is gained by a claim.
    """
    judge, standings = _Hypotheses(data, channels, output).standings()
    left = [s for s in standings if not any(o.beats(s, judge) for o in standings if o is not s)]
    left = left or [min(standings, key=lambda s: float(s.trial.blocks.sum()))]
    plain = [s for s in left if s.lead is None]
    unclaimed = [s for s in plain if s.hypothesis.kind == "other"]
    chosen = min(unclaimed or plain or left, key=lambda s: (s.trial.cost, -s.trial.score))
    one = chosen.hypothesis
    same: list[Kind] = [s.hypothesis.kind for s in left if s is not chosen and _same(s.lead, chosen.lead)]
    return Settled(one.kind, one.baseline, one.extended or {}, _rivals(chosen, left), tuple(same))


def _same(one: Effect | None, other: Effect | None) -> bool:
    return (one and one.name) == (other and other.name)


def _rivals(chosen: Standing, left: Sequence[Standing]) -> tuple[tuple[Kind, Effect], ...]:
    """List other names, with a kind for each; a plain model is in doubt only where an effect does the very same."""
    rivals: dict[str, tuple[Kind, Effect]] = {}
    for one in left:
        same_fit = _fit_alike(one.trial.estimate, chosen.trial.estimate)
        if one.lead and (same_fit if chosen.lead is None else one.lead.name != chosen.lead.name):
            rivals.setdefault(one.lead.name, (one.hypothesis.kind, one.lead))
    return tuple(rivals.values())


@dataclass(frozen=True, eq=False)
class _Hypotheses:
    """The kinds that one output may be of; what is fitted for one of them serves the others."""

    data: TrainingSet
    channels: Channels
    output: int

    def standings(self) -> tuple[Baseline, list[Standing]]:
        """Judge all of them; return the records and the noise of that judgement too."""
        return _judge([*self._with_claims, self._other])

    @property
    def _other(self) -> Hypothesis:
        """Without a claim. High orders take long to extend, so that it is done only where it may tell more.

        Where the plain model of a kind fits alike, effects do the same for both; where a kind with an effect beats a
        plain model of high order, they do no better.
        """
        plain = Hypothesis("other", self._baseline("other"))
        plant, estimate = plain.baseline.plant, plain.baseline.estimate
        for kind in self._with_claims:
            if kind.kind != "level" and _fit_alike(kind.baseline.estimate, estimate):
                return replace(plain, larger=kind.larger)
        if plant.order > 2 or plant.zeros:
            judge, (*moving, other) = _judge([*self._with_claims, plain])
            if any(s.lead is not None and s.beats(other, judge) for s in moving):
                return plain
        return _extended(plain)

    @cached_property
    def _with_claims(self) -> list[Hypothesis]:
        found = [_extended(Hypothesis("velocity", self._baseline("velocity")))]
        position = Hypothesis("position", self._baseline("position"))
        # What follows the force at once is no position: its reading has no share of the velocity.
        zero = position.baseline.estimate.theta[position.baseline.plant.layout.zeros]
        if not (np.abs(zero) > self.data.dt).any():
            found.append(_extended(position))
        if self._never_negative:
            found += _if_tank(Hypothesis("level", self._baseline("level")))
        return found

    def _baseline(self, kind: Kind) -> Baseline:
        data, channels = self.data, with_kind(self.channels, self.output, kind)
        return find_baseline(data.train, data.valid, channels, (self.output,), data.n_init)

    @property
    def _never_negative(self) -> bool:
        signals = np.concatenate([np.column_stack((x.y[:, self.output], x.u)) for x in self.data.train])  # [N, 1 + nu]
        return bool((signals.min(axis=0) >= -BELOW_ZERO * signals.std(axis=0)).all())


def _extended(plain: Hypothesis) -> Hypothesis:
    extended: Extended = {}
    larger = with_any_more(plain.baseline, plain.baseline.estimate, extended)
    return replace(plain, larger=larger, extended=extended)


def _if_tank(level: Hypothesis) -> list[Hypothesis]:
    """List the hypothesis of a level if a law that only levels have may speak for it; its plain model is any lag's."""
    baseline, scales = level.baseline, level.baseline.plant.scales
    assert scales is not None
    elsewhere: tuple[Kind, ...] = ("velocity", "position", "other")

    def own(term: Term) -> bool:
        return not any(term.effect.applies_to(replace(scales.of(term), kind=kind)) for kind in elsewhere)

    fits = [extend(baseline, baseline.estimate, term) for term in candidates(baseline) if own(term)]
    known = tuple(fit for fit in fits if fit is not None)
    return [replace(level, larger=known)] if known else []


def _judge(tried: Sequence[Hypothesis]) -> tuple[Baseline, list[Standing]]:
    """Judge all by the readings that none of them takes for an outlier, under the noise that the best one leaves."""
    unclaimed = tried[-1].baseline
    train = np.logical_and.reduce([h.baseline.train.mask for h in tried])
    valid = np.logical_and.reduce([h.baseline.valid.mask for h in tried])
    judge = replace(unclaimed, train=replace(unclaimed.train, mask=train), valid=replace(unclaimed.valid, mask=valid))
    fits = [fit for h in tried for fit in (h.baseline.estimate, *h.larger)]
    best = min(fits, key=lambda fit: float(np.sum(fit.errors[train] ** 2)))
    noise_order = schwarz_order(best.errors, train, judge.resolution)
    standings = [h.judged(judge, noise_order) for h in tried]
    # A level without a law of its own claims nothing that `other` does not.
    return judge, [s for s in standings if s.hypothesis.kind != "level" or s.lead is not None]
