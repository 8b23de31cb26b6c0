"""Models with one effect more, each candidate begun, and compared while they are fitted."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Literal

from simgap.cores import on_cores
from simgap.greybox.baseline import MAX_STEPS, Baseline
from simgap.greybox.extension import WORTH_A_REFIT, as_special_case, extend, from_other_poles
from simgap.greybox.fitting import Estimate
from simgap.greybox.score_test import Scored, candidates, score_tests
from simgap.greybox.terms import Term

# Steps of a fit until the candidates are compared; the finalists are then fitted to the end.
FEW_STEPS = 6
FINALISTS = 8
PROMISING = 8  # effects of a known machine that are fitted at all
FINALISTS_OF_MACHINE = 5
MORE_STEPS = 8  # until they are compared again

# What is asked for: linear effects, all whose numbers hold for every experiment, or those with numbers of each one.
Among = Literal["linear", "forecast", "own"]
EVERY: tuple[Among, ...] = ("forecast", "own")  # linear ones are among the forecast
# The models with one effect more than those of the key, by what was asked for, and the squares of the one before them.
Key = tuple[frozenset[tuple[str, int, type]], Among]
Extended = dict[Key, tuple[float, tuple[Estimate, ...]]]
# Of the squares that a model had when effects were added to it: where a fit from elsewhere has less, they are anew.
CLEARLY_LESS = 0.98


def with_one_more(baseline: Baseline, estimate: Estimate, extended: Extended, among: Among) -> tuple[Estimate, ...]:
    """Fit a model with each candidate added that is asked for, those to the end that may still be the best.

    What is in `extended` is not fitted again.
    """
    terms = estimate.plant.terms
    key = key_of(terms, among)
    before, known = extended.get(key, (math.inf, ()))
    if estimate.squares > CLEARLY_LESS * before:
        return known

    def worth(fit: Estimate) -> bool:
        gained = 0.5 * baseline.n_errors * math.log(estimate.squares / fit.squares)
        return gained >= WORTH_A_REFIT or bool(fit.plant.per_experiment)

    tried = [term for term in candidates(baseline, terms) if _is_among(term, among)]
    scored, finalists = list(zip(tried, score_tests(baseline, estimate, tried), strict=True)), FINALISTS
    if baseline.plant.machine is not None:  # which needs no other poles for any of them
        scored.sort(key=lambda one: -max((gain for gain, *_ in one[1]), default=0.0))
        scored, finalists = scored[:PROMISING], FINALISTS_OF_MACHINE
    begun = [fit for fit in on_cores(partial(_begin, baseline, estimate), scored) if fit is not None]
    begun.sort(key=lambda fit: _cost(baseline, fit))
    fits = tuple(_anew(baseline, estimate, _race(baseline, begun[:finalists], worth)))
    extended[key] = estimate.squares, fits
    return fits


def with_any_more(baseline: Baseline, estimate: Estimate, extended: Extended, *asked: Among) -> tuple[Estimate, ...]:
    """Fit a model with each candidate added, or with those that are asked for."""
    return tuple(fit for among in asked or EVERY for fit in with_one_more(baseline, estimate, extended, among))


def _begin(baseline: Baseline, estimate: Estimate, tested: tuple[Term, Sequence[Scored]]) -> Estimate | None:
    return extend(baseline, estimate, *tested, max_steps=FEW_STEPS)


def _is_among(term: Term, among: Among) -> bool:
    return term.effect.linear if among == "linear" else bool(term.effect.own) == (among == "own")


def key_of(terms: Sequence[Term], among: Among) -> Key:
    """Return what the models with one effect more than these are remembered by; an effect may have several laws."""
    return frozenset((*term.key, type(term.effect)) for term in terms), among


def known_fits(extended: Extended, terms: Sequence[Term]) -> list[Estimate]:
    """List the fits of just these terms among models with one effect more than another."""
    return [fit for _, fits in extended.values() for fit in fits if set(fit.plant.terms) == set(terms)]


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
    known = {term.key for term in before.plant.terms}
    added = [next(term for term in fit.plant.terms if term.key not in known) for fit in (best, *others)]
    best = from_other_poles(baseline, before, best)
    pairs = list(zip(others, added[1:], strict=True))
    return [best, *on_cores(partial(_from_best, baseline, best, added[0]), pairs)]


def _from_best(baseline: Baseline, best: Estimate, general: Term, other: tuple[Estimate, Term]) -> Estimate:
    """Fit a special case of the best effect from its plant too, with its own numbers and with those that they share."""
    fit, term = other
    if not general.replaces(term):
        return fit
    theta, local = fit.plant.carry(best.plant, best.theta, best.local)
    theta[fit.plant.part_of(term)] = fit.theta[fit.plant.part_of(term)]
    of_own = baseline.fit(fit.plant.terms, [(theta, local)])
    return min(fit, of_own, as_special_case(baseline, best, general, term), key=lambda fit: fit.squares)


def _cost(baseline: Baseline, fit: Estimate) -> float:
    """Weigh squares against the number of parameters, for candidates of one round."""
    n = baseline.n_errors
    parameters = int(fit.plant.free.sum()) + len(fit.local) * fit.plant.n_of_terms
    return 0.5 * n * math.log(fit.squares) + 0.5 * parameters * math.log(n)
