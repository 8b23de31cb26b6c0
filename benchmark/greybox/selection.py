"""Which effects of the catalogue the data ask for: forward selection, backward elimination, exchange."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

from simgap.cores import on_cores
from simgap.greybox.baseline import MAX_STEPS, Baseline
from simgap.greybox.fitting import Estimate
from simgap.greybox.noise import log_likelihood, schwarz_order
from simgap.greybox.score_test import WORTH_A_REFIT, candidates, extend, from_other_poles, jacobian_of, promising
from simgap.greybox.terms import Term
from simgap.greybox.trial import Trial, assess, holds_out, ranked, significant

# Log-likelihood ratio that confirms what the readings show already.
CONFIRMED = 8.0
# By how much the score of another choice of effects must be better to be preferred to the first one.
BETTER = 1.0
# Steps of a fit until the candidates of a round are compared; the finalists are then fitted to the end.
FEW_STEPS = 6
FINALISTS = 8
PROMISING = 8  # effects of a known machine that are fitted at all
FINALISTS_OF_MACHINE = 3
MORE_STEPS = 8  # until they are compared again

Compared = dict[tuple[frozenset[tuple[str, int]], bool], tuple[Trial, ...]]


@dataclass(frozen=True, eq=False)
class Round:
    """One step forward: the model it began with, and that model with each candidate added, the best first."""

    before: Trial
    trials: tuple[Trial, ...]


@dataclass(frozen=True, eq=False)
class Selection:
    """The effects that explain one plant: the model that was chosen, and what it was compared with."""

    baseline: Baseline
    trial: Trial
    noise_order: int
    rounds: tuple[Round, ...]
    compared: Compared
    parts: dict[frozenset[tuple[str, int]], Trial] = field(default_factory=dict)  # with some of the chosen effects only

    @classmethod
    def of_none(cls, baseline: Baseline) -> Selection:
        """Choose no effect, and look for none."""
        return cls(baseline, assess(baseline, baseline.estimate, 0), 0, (), {})

    def only(self, terms: Sequence[Term]) -> Trial:
        """Fit some of the chosen effects again without the others; each choice is fitted once."""
        return self.each_only([terms])[0]

    def each_only(self, choices: Sequence[Sequence[Term]]) -> list[Trial]:
        """Fit each of several choices of the effects again without the others."""
        keys = [frozenset(term.key for term in terms) for terms in choices]
        new = {key: terms for key, terms in zip(keys, choices, strict=True) if key not in self.parts}
        new.pop(whole := frozenset(term.key for term in self.trial.terms), None)
        fits = on_cores(partial(only, self.baseline, self.trial, self.noise_order), list(new.values()))
        self.parts.update(zip(new, fits, strict=True))
        return [self.trial if key == whole else self.parts[key] for key in keys]

    def without(self, term: Term) -> Trial:
        """Fit the chosen model again with one term less."""
        return self.only([other for other in self.trial.terms if other != term])

    def has_compared(self, trial: Trial) -> bool:
        """Tell whether a model with each candidate added was fitted already."""
        return (frozenset(term.key for term in trial.terms), False) in self.compared

    def compare(self, trial: Trial) -> list[Trial]:
        """Fit and assess a model with each candidate added; what the selection has compared is not fitted again."""
        return compare(self.baseline, trial.estimate, self.noise_order, dict(self.compared))


def select(baseline: Baseline, compared: Compared | None = None) -> Selection:
    """Choose effects: what the readings show, what a linear model lacks, then all; superfluous ones are taken out.

    What was `compared` before on this baseline is not fitted again.
    """
    search = _Search(baseline, compared=dict(compared or {}))
    trial = search.visible(assess(baseline, baseline.estimate, 0))
    if baseline.plant.machine is None:
        trial = search.forward(trial, linear_only=True)
    trial = search.forward(trial)
    trial = search.backward(trial)
    if baseline.plant.machine is None:  # the order of a known machine is no guess that an early choice rests on
        trial = search.exchange(trial)
    return Selection(baseline, trial, search.noise_order, tuple(search.rounds), search.compared)


@dataclass
class _Search:
    """A selection under way. The noise order belongs to the best model so far; every round chooses it anew."""

    baseline: Baseline
    noise_order: int = 0
    rounds: list[Round] = field(default_factory=list)
    compared: Compared = field(default_factory=dict)

    def visible(self, trial: Trial) -> Trial:
        """Add what the readings themselves show, before the errors of any model are asked."""
        for term in candidates(self.baseline):
            if not term.effect.visible_in_readings:
                continue
            estimate = extend(self.baseline, trial.estimate, term)
            larger = self._assess(estimate) if estimate is not None else trial
            if passes(self.baseline, term, trial, larger):
                trial = larger
        return trial

    def forward(self, trial: Trial, linear_only: bool = False) -> Trial:
        """Add the best effect, one after the other, while noise alone would not do as well."""
        while len(trial.terms) < self.baseline.plant.most_terms:
            trials = compare(self.baseline, trial.estimate, self.noise_order, self.compared, linear_only)
            if trials and self.baseline.plant.machine is None:  # whose many free runs judge, not the next sample
                best = min(trials, key=lambda trial: trial.estimate.squares).estimate
                self.noise_order = schwarz_order(best.errors, self.baseline.train.mask, self.baseline.resolution)
                trial = self._assess(trial.estimate)
                trials = ranked([self._assess(other.estimate) for other in trials])
            self.rounds.append(Round(trial, tuple(trials)))
            better = ranked([other for other in trials if significant(self.baseline, trial, other)])
            if not better:
                break
            trial = better[0]
        return trial

    def backward(self, trial: Trial) -> Trial:
        """Take out, one by one, the effects that no longer pass alone against the rest; those that stay do."""
        while trial.terms:
            smaller = on_cores(partial(without, self.baseline, trial, self.noise_order), trial.terms)
            enough = [
                other
                for term, other in zip(trial.terms, smaller, strict=True)
                if not passes(self.baseline, term, other, trial)
            ]
            if not enough:
                break
            trial = max(enough, key=lambda other: other.score)
        return trial

    def exchange(self, trial: Trial) -> Trial:
        """Try every other effect in the place of each, because the first choice was made without the others.

        Where the search ran into the largest number of effects, no exchange makes them the explanation.
        """
        for term in trial.terms if 1 < len(trial.terms) < self.baseline.plant.most_terms else ():
            if term not in trial.terms or term.effect.visible_in_readings:
                continue
            rest = self._without(trial, term)
            trials = compare(self.baseline, rest.estimate, self.noise_order, self.compared)
            trials = ranked([other for other in trials if significant(self.baseline, rest, other)])
            if trials and trials[0].score > trial.score + BETTER:
                trial = self.backward(trials[0])
        return trial

    def _assess(self, estimate: Estimate) -> Trial:
        return assess(self.baseline, estimate, self.noise_order)

    def _without(self, trial: Trial, term: Term) -> Trial:
        return without(self.baseline, trial, self.noise_order, term)


def passes(baseline: Baseline, term: Term, smaller: Trial, larger: Trial) -> bool:
    """Tell whether the larger model needs the effect that the smaller one does without.

    What the readings show already must only be confirmed, by errors without memory.
    """
    if not term.effect.visible_in_readings:
        return significant(baseline, smaller, larger)
    train = baseline.train
    without, within = (log_likelihood(t.estimate.errors, train.mask, 0, train.resolution) for t in (smaller, larger))
    return within - without > CONFIRMED and holds_out(baseline, smaller, larger)


def without(baseline: Baseline, trial: Trial, noise_order: int, term: Term) -> Trial:
    """Fit a model again with one term less."""
    return only(baseline, trial, noise_order, [other for other in trial.terms if other != term])


def only(baseline: Baseline, trial: Trial, noise_order: int, terms: Sequence[Term]) -> Trial:
    """Fit a model again with some of its terms, from its linear part and from the plain one."""
    plant = baseline.plant.having(terms)
    theta, local = plant.carry(trial.estimate.plant, trial.estimate.theta, trial.estimate.local)
    plain, of_plain = plant.carry(baseline.plant, baseline.estimate.theta, baseline.estimate.local)
    plain[plant.n_linear :] = theta[plant.n_linear :]
    return assess(baseline, baseline.fit(plant.terms, [(theta, local), (plain, of_plain)]), noise_order)


def compare(
    baseline: Baseline, estimate: Estimate, noise_order: int, compared: Compared, linear_only: bool = False
) -> list[Trial]:
    """Add every candidate (or the linear ones) to a model, refit and assess it; the best first.

    `compared` holds the candidates of the models that were asked for before; they are assessed anew, not fitted.
    """
    terms = estimate.plant.terms
    key = (frozenset(term.key for term in terms), linear_only)
    if key in compared:
        return ranked([assess(baseline, trial.estimate, noise_order) for trial in compared[key]])
    jacobian = jacobian_of(baseline, estimate)
    before = baseline.squares_of(estimate)

    def worth(fit: Estimate) -> bool:
        gained = 0.5 * baseline.n_errors * math.log(before / fit.squares)
        return gained >= WORTH_A_REFIT or bool(fit.plant.per_experiment)

    tried = [term for term in candidates(baseline, terms) if term.effect.linear or not linear_only]
    finalists = FINALISTS
    if baseline.plant.machine is not None:
        tried, finalists = promising(baseline, estimate, tried, jacobian, PROMISING), FINALISTS_OF_MACHINE
    begin = partial(extend, baseline, estimate, jacobian=jacobian, max_steps=FEW_STEPS)
    begun = [fit for fit in on_cores(begin, tried) if fit is not None]
    begun.sort(key=lambda fit: _cost(baseline, fit))
    finalists = _anew(baseline, estimate, _race(baseline, begun[:finalists], worth))
    compared[key] = tuple(on_cores(partial(assess, baseline, noise_order=noise_order), finalists))
    return ranked(list(compared[key]))


def _race(baseline: Baseline, fits: list[Estimate], worth: Callable[[Estimate], bool]) -> list[Estimate]:
    """Go on with fits until all have converged but those that are behind the best by more than their last gain."""
    fits, gains = list(fits), [math.inf] * len(fits)
    for _ in range(MAX_STEPS // MORE_STEPS):
        costs = [_cost(baseline, fit) for fit in fits]
        running = [
            i for i, fit in enumerate(fits)
            if not fit.converged and worth(fit) and costs[i] - min(costs) <= gains[i]
        ]  # fmt: skip
        for i, fit in zip(running, on_cores(partial(_go_on, baseline), [fits[i] for i in running]), strict=True):
            fits[i], gains[i] = fit, costs[i] - _cost(baseline, fit)
    return fits


def _go_on(baseline: Baseline, fit: Estimate) -> Estimate:
    return baseline.fit(fit.plant.terms, [(fit.theta, fit.local)], MORE_STEPS)


def _anew(baseline: Baseline, before: Estimate, fits: list[Estimate]) -> list[Estimate]:
    """Fit the best effect from other poles too, and its special cases from its plant."""
    if not fits:
        return fits
    best = min(fits, key=lambda fit: _cost(baseline, fit))
    others = [fit for fit in fits if fit is not best]
    best = from_other_poles(baseline, before, best)
    return [best, *on_cores(partial(_from_best, baseline, best), others)]


def _from_best(baseline: Baseline, best: Estimate, fit: Estimate) -> Estimate:
    plant, term = fit.plant, fit.plant.terms[-1]
    if term.effect.name not in best.plant.terms[-1].effect.contains:
        return fit
    theta, local = plant.carry(best.plant, best.theta, best.local)
    theta[plant.part_of(term)] = fit.theta[plant.part_of(term)]
    return min(fit, baseline.fit(plant.terms, [(theta, local)]), key=lambda fit: fit.squares)


def _cost(baseline: Baseline, fit: Estimate) -> float:
    """Weigh squares against the number of parameters, for candidates of one round."""
    n = baseline.n_errors
    parameters = int(fit.plant.free.sum()) + len(fit.local) * len(fit.plant.per_experiment)
    return 0.5 * n * math.log(fit.squares) + 0.5 * parameters * math.log(n)
