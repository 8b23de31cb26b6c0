"""Models with one effect more: each begun where that promises most, away from what stood in for it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np

from simgap.cores import on_cores
from simgap.greybox.baseline import MAX_STEPS, TOLERANCE, Baseline
from simgap.greybox.fitting import Estimate, descend
from simgap.greybox.held_out import on_other_records
from simgap.greybox.machine import StandIn
from simgap.greybox.plant import Plant
from simgap.greybox.pole_search import refit_from_poles
from simgap.greybox.refits import STOOD_IN, WORTH_A_REFIT, finals
from simgap.greybox.score_test import STARTS, Scored, candidates, score_tests, with_term
from simgap.greybox.terms import Term, in_each_order
from simgap.greybox.unfolding import unfolded

FEW_STEPS = 6  # of a fit until the candidates are compared
FINALISTS = 8  # are fitted to the end
PROMISING = 8  # effects of a known machine that are fitted at all
FINALISTS_OF_MACHINE = 5
FIRST_STEPS = 8  # of a fit from each of many starts
VALLEYS = 6  # of many that a fit to short pieces descends into
LONGER = 4  # times as long are the pieces that a fit goes on with

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
    tried = [term for term in candidates(baseline, terms) if _is_among(term, among)]
    scored, finalists = list(zip(tried, score_tests(baseline, estimate, tried), strict=True)), FINALISTS
    if baseline.plant.machine is not None:  # which needs no other poles for any of them
        scored.sort(key=lambda one: -max((gain for gain, *_ in one[1]), default=0.0))
        scored, finalists = scored[:PROMISING], FINALISTS_OF_MACHINE
    begun = [fit for fit in on_cores(partial(_begin, baseline, estimate), scored) if fit is not None]
    fits = tuple(finals(baseline, estimate, begun, finalists))
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


def extend(
    baseline: Baseline,
    estimate: Estimate,
    term: Term,
    scored: Sequence[Scored] | None = None,
    max_steps: int = MAX_STEPS,
) -> Estimate | None:
    """Fit the model with one effect more, from the starts with the best scores; None if none is worth it.

    The effect is tested here where it has not been `scored`. Where effects may act in either order, the better one is
    taken.
    """
    orders = in_each_order(with_term(estimate.plant, term).terms)
    fits = [_extend(baseline, estimate, estimate.plant.having(terms), term, scored, max_steps) for terms in orders]
    return min((fit for fit in fits if fit is not None), key=lambda fit: fit.squares, default=None)


def add(baseline: Baseline, estimate: Estimate, term: Term) -> Estimate:
    """Fit the model with one effect more, whatever the score test says of it; none where it has nowhere to begin."""
    if not baseline.plant.starts_of(term):
        return estimate
    extended = extend(baseline, estimate, term)
    if extended is not None:
        return extended
    plant = baseline.plant.having([*estimate.plant.terms, term])
    return baseline.fit(plant.terms, started(estimate, plant, term))


def _extend(
    baseline: Baseline, estimate: Estimate, plant: Plant, term: Term, scored: Sequence[Scored] | None, max_steps: int
) -> Estimate | None:
    if term in plant.per_experiment:
        return baseline.fit(plant.terms, started(estimate, plant, term), max_steps)
    if term.effect.moves_poles and plant.machine is None:
        return _from_other_poles(baseline, estimate, plant, term, max_steps)
    scored = score_tests(baseline, estimate, [term])[0] if scored is None else scored
    if not scored:
        return None
    begun = [(theta, local) for _, theta, local in scored[:STARTS]]
    if plant.kind in term.effect.may_move_poles_of and plant.machine is None:
        thetas = [theta for theta, _ in begun + started(estimate, plant, term)]  # a score from far poles may mislead
        afresh = refit_from_poles(baseline.problem(plant), thetas, max_steps, TOLERANCE)
        return min(afresh, baseline.fit(plant.terms, begun, max_steps), key=lambda fit: fit.squares)
    if scored[0][0] < WORTH_A_REFIT:
        return None
    if plant.machine is not None and (stand_in := plant.machine.stand_in(term)) is not None:
        begun = begun[:1] + _without(stand_in, baseline, estimate, plant, term)
    if term.effect.many_valleys and plant.machine is None:
        begun, max_steps = [*begun, _from_pieces(baseline, estimate, plant, term)], MAX_STEPS
    return baseline.fit(plant.terms, begun, max_steps)


def started(estimate: Estimate, plant: Plant, term: Term) -> list[tuple[np.ndarray, np.ndarray]]:
    """Carry a fitted model over into a larger one, with the new term at each of its starts; its own numbers at zero."""
    starts = []
    for start in plant.starts_of(term):
        theta, local = plant.carry(estimate.plant, estimate.theta, estimate.local)
        theta[plant.part_of(term)] = start.values[len(start.values) - len(plant.common_of(term)) :]
        starts.append((theta, local))
    return starts


def _from_pieces(baseline: Baseline, estimate: Estimate, plant: Plant, term: Term) -> tuple[np.ndarray, np.ndarray]:
    """Begin where an effect does best in short pieces, in which the simulation stays near the readings.

    Over a whole record a force over position would be looked for where a wrong simulation has led.
    """
    problem = baseline.in_pieces(baseline.plant)
    pieces = replace(baseline, train=problem.records, estimate=descend(problem, baseline.estimate.theta))
    before = descend(pieces.problem(estimate.plant), estimate.theta)
    (scored,) = score_tests(pieces, before, [term])
    fits = [pieces.fit(plant.terms, [start[1:]]) for start in scored[:VALLEYS]]
    fit, samples = min(fits, key=lambda fit: fit.squares), pieces.train.mask.shape[1]
    while samples < baseline.train.mask.shape[1]:
        samples *= LONGER
        longer = baseline.in_pieces(plant, samples)
        fit = descend(longer, fit.theta, on_other_records(longer, fit.theta).local)  # from rest, it may be led away
    return fit.theta, fit.local


def _from_other_poles(baseline: Baseline, estimate: Estimate, plant: Plant, term: Term, max_steps: int) -> Estimate:
    """Fit an effect without which the linear plant has other poles: they are searched for anew."""
    thetas = [theta for theta, _ in started(estimate, plant, term)]
    known = {start.amplitude for start in plant.starts_of(term)} - {None}
    amplitudes = [plant.part_of(term).start + number for number in known]
    fit = refit_from_poles(baseline.problem(plant), thetas, max_steps, TOLERANCE, amplitudes)
    if term.effect.hides_sign and plant.ny == 1 and not plant.joint:
        plain = unfolded(baseline.plant, baseline.train)
        theta, local = plant.carry(plain.plant, plain.theta, plain.local)
        theta[plant.n_linear :] = thetas[0][plant.n_linear :]
        return min(fit, baseline.fit(plant.terms, [(theta, local)], max_steps), key=lambda fit: fit.squares)
    if term.effect.replaces_spring and plant.order == 2 and (stiffness := estimate.theta[1]) > 0:
        theta, local = plant.carry(estimate.plant, estimate.theta, estimate.local)
        assert plant.scales is not None
        theta[plant.part_of(term)] = term.effect.as_spring(stiffness, plant.scales.of(term))
        fit = min(fit, baseline.fit(plant.terms, [(theta, local)], max_steps), key=lambda fit: fit.squares)
    far_off = fit.squares >= STOOD_IN * baseline.estimate.squares
    if not (term.effect.errors_grow and far_off) or plant.joint or plant.per_experiment:
        return fit
    # Multiple shooting (Bock, Recent advances in parameter identification techniques for ODE, 1983).
    of_pieces = refit_from_poles(baseline.in_pieces(plant), thetas, MAX_STEPS, TOLERANCE)
    return min(fit, baseline.fit(plant.terms, [(of_pieces.theta, None)], max_steps), key=lambda fit: fit.squares)


def _without(
    stand_in: StandIn, baseline: Baseline, estimate: Estimate, plant: Plant, term: Term
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Begin an effect from each of its starts with what stood in for it out of its way; return the best ones."""
    problem, at, fits = baseline.problem(plant), stand_in.at, []
    fixed = np.arange(plant.size) == at if stand_in.stays else None
    for theta, local in started(estimate, plant, term):
        for factor in stand_in.factors:
            theta[at] = np.clip(factor * estimate.theta[at], plant.low[at], plant.high[at])
            fits.append(descend(problem, theta.copy(), local, fixed, FIRST_STEPS, TOLERANCE))
    fits.sort(key=lambda fit: fit.squares)
    return [(fit.theta, fit.local) for fit in fits[:STARTS]]
