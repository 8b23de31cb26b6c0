"""A model with one effect more: begun where that promises most, away from what stood in for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from simgap.greybox.baseline import MAX_STEPS, TOLERANCE, Baseline
from simgap.greybox.fitting import Estimate, descend
from simgap.greybox.held_out import on_other_records
from simgap.greybox.machine import StandIn
from simgap.greybox.plant import Plant
from simgap.greybox.pole_search import refit_from_poles
from simgap.greybox.score_test import STARTS, Scored, score_tests, with_term
from simgap.greybox.terms import Term, in_each_order
from simgap.greybox.unfolding import unfolded

# Score tests below this log-likelihood ratio are not worth a refit.
WORTH_A_REFIT = 2.0
FIRST_STEPS = 8  # of a fit from each of many starts
VALLEYS = 6  # of many that a fit to short pieces descends into
LONGER = 4  # times as long are the pieces that a fit goes on with
STOOD_IN = 0.5  # of the error: what an effect leaves whose part the poles had taken


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
    fine = replace(term, effect=law())
    plant = baseline.plant.having([fine if other == term else other for other in estimate.plant.terms])
    theta, local = plant.carry(estimate.plant, estimate.theta, estimate.local)
    part = plant.part_of(fine)
    theta[part] = np.clip(numbers, plant.low[part], plant.high[part])
    return baseline.fit(plant.terms, [(theta, local)])


def simpler(estimate: Estimate, term: Term) -> Mapping[str, np.ndarray]:
    """Return the laws with fewer numbers that may do as well as a term as it was fitted, with their numbers."""
    plant = estimate.plant
    if term in plant.per_experiment:
        return {}
    assert plant.scales is not None
    return term.effect.simpler(estimate.theta[plant.part_of(term)], plant.scales.of(term))


def as_special_case(baseline: Baseline, estimate: Estimate, general: Term, special: Term) -> Estimate:
    """Fit a model again with a special case in the place of an effect, begun with what the two share."""
    plant = baseline.plant.having([*(term for term in estimate.plant.terms if term != general), special])
    theta, local = plant.carry(estimate.plant, estimate.theta, estimate.local)
    part = plant.part_of(special)
    numbers = simpler(estimate, general)[special.effect.name]
    theta[part] = np.clip(numbers, plant.low[part], plant.high[part])
    return baseline.fit(plant.terms, [(theta, local)])
