"""Models fitted again: to the end beside others, from other poles, with a finer law or with a special case of one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from simgap.cores import on_cores
from simgap.greybox.baseline import MAX_STEPS, TOLERANCE, Baseline
from simgap.greybox.fitting import Estimate
from simgap.greybox.pole_search import refit_from_poles
from simgap.greybox.terms import Term

# Gains in log-likelihood below this one, whether of a score test or of a fit, are not worth a refit.
WORTH_A_REFIT = 2.0
MORE_STEPS = 8  # of a fit until it is compared with the others again
STOOD_IN = 0.5  # of the error: what an effect leaves whose part the poles had taken


def finals(baseline: Baseline, before: Estimate, begun: list[Estimate], finalists: int) -> list[Estimate]:
    """Fit the best of the models that add one effect to the one before to the end, from elsewhere too."""
    best_first = sorted(begun, key=lambda fit: _cost(baseline, fit))
    return _anew(baseline, before, _race(baseline, before, best_first[:finalists]))


def _race(baseline: Baseline, before: Estimate, fits: list[Estimate]) -> list[Estimate]:
    """Go on with fits until all have converged but those that are behind the best by more than their last gain."""

    def worth(fit: Estimate) -> bool:
        gained = 0.5 * baseline.n_errors * math.log(before.squares / fit.squares)
        return gained >= WORTH_A_REFIT or bool(fit.plant.per_experiment)

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


def from_other_poles(baseline: Baseline, before: Estimate, fit: Estimate) -> Estimate:
    """Fit a model from other poles too where its last effect takes most of the squared error that was there before.

    The poles that the model had then stood in for the effect, and no descent may lead away from them.
    """
    if fit.squares > STOOD_IN * before.squares or fit.plant.joint:
        return fit
    afresh = refit_from_poles(baseline.problem(fit.plant), [fit.theta], MAX_STEPS, TOLERANCE)
    return min(fit, afresh, key=lambda fit: fit.squares)


def refine(baseline: Baseline, estimate: Estimate, term: Term) -> Estimate | None:
    """Fit the form of a law that has more numbers, begun with the same law; None where there is none."""
    law, numbers = term.effect.refined, term.effect.as_refined(estimate.theta[estimate.plant.part_of(term)])
    if law is None or numbers is None:
        return None
    return _in_place_of(baseline, estimate, term, replace(term, effect=law()), numbers)


def simpler(estimate: Estimate, term: Term) -> Mapping[str, np.ndarray]:
    """Return the laws with fewer numbers that may do as well as a term as it was fitted, with their numbers."""
    plant = estimate.plant
    if term in plant.per_experiment:
        return {}
    assert plant.scales is not None
    return term.effect.simpler(estimate.theta[plant.part_of(term)], plant.scales.of(term))


def as_special_case(baseline: Baseline, estimate: Estimate, general: Term, special: Term) -> Estimate:
    """Fit a model again with a special case in the place of an effect, begun with what the two share."""
    return _in_place_of(baseline, estimate, general, special, simpler(estimate, general)[special.effect.name])


def _in_place_of(baseline: Baseline, estimate: Estimate, term: Term, other: Term, numbers: np.ndarray) -> Estimate:
    """Fit a model again with another term in the place of one, begun with these numbers and the rest as it was."""
    plant = baseline.plant.having([*(one for one in estimate.plant.terms if one != term), other])
    theta, local = plant.carry(estimate.plant, estimate.theta, estimate.local)
    part = plant.part_of(other)
    theta[part] = np.clip(numbers, plant.low[part], plant.high[part])
    return baseline.fit(plant.terms, [(theta, local)])
