"""The search for effects, under way: forward, backward, in exchange, and to finer laws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

from simgap.cores import on_cores
from simgap.greybox.additions import Among, Extended, add, extend, known_fits, with_any_more
from simgap.greybox.baseline import Baseline
from simgap.greybox.fitting import Estimate
from simgap.greybox.held_out import in_most
from simgap.greybox.noise import log_likelihood
from simgap.greybox.refits import as_special_case, from_other_poles, refine, simpler
from simgap.greybox.score_test import candidates
from simgap.greybox.terms import Term
from simgap.greybox.trial import Trial, assess, assessed, beyond_chance, holds_out, judged, ranked, significant
from simgap.stages import stage

# Log-likelihood ratio that confirms what the readings show already.
CONFIRMED = 8.0
# By how much the score of another choice of effects must be better to be preferred to the first one.
BETTER = 1.0


@dataclass(frozen=True, eq=False)
class Round:
    """One step forward: the model it began with, and that model with each candidate added, the best first."""

    before: Trial
    trials: tuple[Trial, ...]


@dataclass
class Search:
    """A selection under way. The noise order belongs to the best model so far; every round chooses it anew."""

    baseline: Baseline
    noise_order: int = 0
    rounds: list[Round] = field(default_factory=list)
    extended: Extended = field(default_factory=dict)
    parts: dict[frozenset[tuple[str, int]], Trial] = field(default_factory=dict)  # the last model less one effect each

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

    def settled(self, trial: Trial, *asked: Among) -> Trial:
        """Take out what is superfluous, and try what is asked for in the place of what is left."""
        trial = self.backward(trial)
        # The order of a known machine is no guess that an early choice rests on.
        return self.exchange(trial, *asked) if self.baseline.plant.machine is None else trial

    def with_own(self, trial: Trial) -> Trial:
        """Add what has numbers of its own in every experiment; where that is better, all effects may join it."""
        # Beside nothing, all have been fitted already, and are what such an effect must be told from.
        larger = self.backward(self.forward(trial, "own") if trial.terms else self.forward(trial))
        larger = self._told_apart(larger)
        alone = self._assess(trial.estimate)  # under the same noise
        if larger.terms == trial.terms or larger.score < alone.score + BETTER:
            return alone
        return self.settled(self.forward(larger))

    def refined(self, trial: Trial) -> Trial:
        """Give each law more numbers where it has a form with more that says more; what that makes superfluous goes.

        The causes have their names already: held-out free runs need not confirm them once more, only not deny the finer
        law, and a cause goes where the score is no lower without it.
        """
        for term in trial.terms:
            fit = refine(self.baseline, trial.estimate, term) if term in trial.terms else None
            if fit is None:
                continue
            noise_order, coarse, (fine,) = judged(self.baseline, trial, [fit], self.noise_order)
            if fine.score > coarse.score + BETTER and not in_most(fine.blocks - coarse.blocks):
                self.noise_order, trial, self.parts = noise_order, fine, {}
                while (fewer := self._without_one(trial)) and fewer.score >= trial.score:
                    trial = fewer
        return trial

    def _without_one(self, trial: Trial) -> Trial | None:
        """Take out the term without which the score is highest."""
        smaller = self._each_less(trial, [(term, None) for term in trial.terms])
        return max(smaller, key=lambda other: other.score, default=None)

    def _told_apart(self, trial: Trial) -> Trial:
        """Try what has own numbers in each experiment in the place of another, and laws with more of them."""
        for term in trial.terms:
            if (term.effect.own or term.effect.of_each) and term in trial.terms:
                trial = self._better(trial, self._in_place_of(term, trial, "own"))
        for term in candidates(self.baseline):
            if not term.effect.own or term.effect.refined is None:
                continue
            rest = self._without(trial, term) if term in trial.terms else trial
            estimate = add(self.baseline, rest.estimate, Term(term.effect.refined(), term.channel))
            larger = self._assess(from_other_poles(self.baseline, rest.estimate, estimate))
            if significant(self.baseline, rest, larger):
                trial = self._better(trial, [larger])
        return trial

    def forward(self, trial: Trial, *asked: Among) -> Trial:
        """Add the best effect, or of those asked for, one after the other, while noise alone would not do as well."""
        while len(trial.terms) < self.baseline.plant.most_terms:
            stage(_looking(trial, asked))
            fits = with_any_more(self.baseline, trial.estimate, self.extended, *asked)
            self.noise_order, trial, trials = judged(self.baseline, trial, fits, self.noise_order)
            self.rounds.append(Round(trial, trials))
            better = ranked([other for other in trials if significant(self.baseline, trial, other)])
            better = better or self._two_at_once(trial, trials, *asked)
            if not better:
                break
            trial = better[0]
        return trial

    def _two_at_once(self, trial: Trial, trials: Sequence[Trial], *asked: Among) -> list[Trial]:
        """Add two effects of which the first simulates held-out data no better without the second.

        The first makes the next sample likelier, in training and held out: a lag of the sensor, beside a friction that
        leads free runs astray.
        """
        likelier = [
            other for other in trials if other.valid > trial.valid and beyond_chance(self.baseline, trial, other)
        ]
        if not likelier or len(trial.terms) + 2 > self.baseline.plant.most_terms:
            return []
        first = max(likelier, key=lambda other: other.score)
        pairs = self._one_more(first, *asked)
        return ranked([two for two in pairs if all(significant(self.baseline, one, two) for one in (trial, first))])

    def backward(self, trial: Trial) -> Trial:
        """Take out, one by one, what no longer passes alone against the rest; what stays does.

        That is an effect, or what makes it more general than a special case of it.
        """
        while trial.terms:
            choices = [(term, special) for term in trial.terms for special in (None, *self._special_cases(trial, term))]
            smaller = self._each_less(trial, choices)
            fitted = zip(choices, smaller, strict=True)
            self.parts = {as_set(other.terms): other for (_, special), other in fitted if special is None}
            enough = [
                other
                for (term, _), other in zip(choices, smaller, strict=True)
                if not passes(self.baseline, term, other, trial)
            ]
            if not enough:
                break
            trial = max(enough, key=lambda other: other.score)
        return trial

    def _special_cases(self, trial: Trial, term: Term) -> list[Term]:
        laws = simpler(trial.estimate, term)
        others = [other for other in candidates(self.baseline) if other not in trial.terms] if laws else []
        return [other for other in others if other.effect.name in laws and other.channel == term.channel]

    def exchange(self, trial: Trial, *asked: Among) -> Trial:
        """Try every other effect that is asked for in the place of each: the first was chosen without the others.

        A choice that errs less on held-out data, though it is less likely in training, is a way to one of two others:
        a curve and a friction are the best in the place of each other where both stand for a dead zone and unequal
        gains. Where the search ran into the largest number of effects, no exchange makes them the explanation.
        """
        for term in trial.terms if 1 < len(trial.terms) < self.baseline.plant.most_terms else ():
            if term not in trial.terms or term.effect.visible_in_readings:
                continue
            found = self._in_place_of(term, trial, *asked)
            trial = self._better(trial, found)
            on_the_way = next((other for other in found if in_most(trial.blocks - other.blocks)), None)
            if on_the_way:
                kept = [one for one in trial.terms if one in on_the_way.terms]
                found = ranked([other for one in kept for other in self._in_place_of(one, on_the_way, *asked)])
                trial = self._better(trial, found)
        return trial

    def _better(self, trial: Trial, found: Sequence[Trial]) -> Trial:
        return self.backward(found[0]) if found and found[0].score > trial.score + BETTER else trial

    def _in_place_of(self, term: Term, trial: Trial, *asked: Among) -> list[Trial]:
        """List the models with another effect in the place of one, the best first."""
        stage(f"Trying others in the place of {term.effect.title}")
        rest = self._without(trial, term)
        return ranked([other for other in self._one_more(rest, *asked) if significant(self.baseline, rest, other)])

    def _one_more(self, trial: Trial, *asked: Among) -> list[Trial]:
        fits = with_any_more(self.baseline, trial.estimate, self.extended, *asked)
        return assessed(self.baseline, fits, self.noise_order)

    def _assess(self, estimate: Estimate) -> Trial:
        return assess(self.baseline, estimate, self.noise_order)

    def _without(self, trial: Trial, term: Term) -> Trial:
        return self._each_less(trial, [(term, None)])[0]

    def _each_less(self, trial: Trial, choices: Sequence[tuple[Term, Term | None]]) -> list[Trial]:
        """Fit a model again without a term, or with a special case of it, for each of these choices."""
        fits = on_cores(partial(with_less, self.baseline, trial, self.noise_order), choices)
        return [or_known(self.baseline, self.noise_order, self.extended, fit) for fit in fits]


def as_set(terms: Sequence[Term]) -> frozenset[tuple[str, int]]:
    """Return what a choice of terms is remembered by."""
    return frozenset(term.key for term in terms)


def _looking(trial: Trial, asked: Sequence[Among]) -> str:
    beside = ", ".join(term.effect.title for term in trial.terms)
    wanted = "delay, lag and constant load" if "linear" in asked else "a cause"
    return f"Looking for {wanted} beside {beside}" if beside else f"Looking for {wanted}"


def passes(baseline: Baseline, term: Term, smaller: Trial, larger: Trial) -> bool:
    """Tell whether the larger model needs the effect that the smaller one does without.

    What the readings show already must only be confirmed, by errors without memory.
    """
    if not term.effect.visible_in_readings:
        return significant(baseline, smaller, larger)
    train = baseline.train
    without, within = (log_likelihood(t.estimate.errors, train.mask, 0, train.resolution) for t in (smaller, larger))
    return within - without > CONFIRMED and holds_out(baseline, smaller, larger)


def with_less(baseline: Baseline, trial: Trial, noise_order: int, less: tuple[Term, Term | None]) -> Trial:
    """Fit a model again without a term, or with a special case of it."""
    term, special = less
    if special is None:
        return only(baseline, trial, noise_order, [other for other in trial.terms if other != term])
    return assess(baseline, as_special_case(baseline, trial.estimate, term, special), noise_order)


def only(baseline: Baseline, trial: Trial, noise_order: int, terms: Sequence[Term]) -> Trial:
    """Fit a model again with some of its terms, from its linear part and from the plain one."""
    plant = baseline.plant.having(terms)
    theta, local = plant.carry(trial.estimate.plant, trial.estimate.theta, trial.estimate.local)
    plain, of_plain = plant.carry(baseline.plant, baseline.estimate.theta, baseline.estimate.local)
    plain[plant.n_linear :] = theta[plant.n_linear :]
    return assess(baseline, baseline.fit(plant.terms, [(theta, local), (plain, of_plain)]), noise_order)


def or_known(baseline: Baseline, noise_order: int, extended: Extended, trial: Trial) -> Trial:
    """Return the better fit of a trial's terms: its own, or one that the search came by on its way to larger models.

    From a model with more effects a fit may end in another valley: a torque by position, in the shortest period.
    """
    best = min([trial.estimate, *known_fits(extended, trial.terms)], key=lambda fit: fit.squares)
    return trial if best is trial.estimate else assess(baseline, best, noise_order)
