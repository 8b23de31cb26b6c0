"""Candidates for the next effect: which apply, what each promises by its score test, and the model with one more."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from simgap.greybox.baseline import MAX_STEPS, TOLERANCE, Baseline
from simgap.greybox.fitting import Estimate, descend
from simgap.greybox.machine import DAMPING
from simgap.greybox.normal_equations import LARGEST_SLOPE, Jacobian, NormalEquations
from simgap.greybox.plant import Plant
from simgap.greybox.pole_search import refit_from_poles
from simgap.greybox.terms import Term
from simgap.greybox.unfolding import unfolded
from simgap.registry import EFFECTS

# Score tests below this log-likelihood ratio are not worth a refit.
WORTH_A_REFIT = 2.0
# Starts of an effect that are refitted: those with the best scores.
STARTS = 2
FIRST_STEPS = 8  # of a fit from each of many starts
STOOD_IN = 0.5  # of the error: what an effect leaves whose part the poles had taken


def candidates(baseline: Baseline, terms: Sequence[Term] = ()) -> list[Term]:
    """List every effect that applies to the plant, has where to begin and is not among `terms`, on every channel."""
    plant, scales = baseline.plant, baseline.plant.scales
    assert scales is not None
    taken = {term.key for term in terms}
    contained = {name for term in terms for name in term.effect.contains}
    listed = []
    for name in EFFECTS.names():
        effect = EFFECTS[name]()
        if not effect.simulated or name in contained or (effect.time_power is not None and not baseline.repeated):
            continue
        channels = {"input": plant.input_channels, "force": range(1), "output": range(plant.ny)}[effect.port]
        on_channels = [Term(effect, channel) for channel in channels if plant.takes(effect, channel)]
        listed += [
            t for t in on_channels
            if t.key not in taken and effect.applies_to(scales.of(t)) and effect.starts(scales.of(t))
        ]  # fmt: skip
    return listed


def score(
    baseline: Baseline, estimate: Estimate, plant: Plant, term: Term, jacobian: Jacobian
) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Test each start of an effect: the log-likelihood it would gain, to first order, with theta and local numbers.

        d = simulation with the effect - simulation without, made orthogonal to the model's own slopes
        gain = -N/2 log(1 - (d' e)^2 / (d' d  e' e))

    Where d grows in proportion to a parameter, the start moves to the amplitude that fits best (Rao 1948).
    """
    noise = baseline.noise
    e = noise.whiten(estimate.errors).reshape(len(estimate.local), -1)
    ee = baseline.squares_of(estimate)
    extended = baseline.problem(plant)
    without = baseline.problem(estimate.plant).simulator.run(estimate.theta, estimate.local)
    scored = []
    for start in plant.starts_of(term):
        theta, local = plant.carry(estimate.plant, estimate.theta, estimate.local)
        part, amplitude = plant.part_of(term), start.amplitude
        theta[part] = start.values
        with np.errstate(invalid="ignore", over="ignore"):  # of simulations that grow without bound
            if baseline.train.soft:
                change = estimate.errors - extended.errors(theta, local)
            else:
                change = extended.simulator.run(theta, local) - without
        d = noise.whiten(np.where(baseline.train.mask[:, :, None], change, 0.0)).reshape(e.shape)
        if not (jacobian.finite and 1 / LARGEST_SLOPE < np.max(np.abs(d)) < LARGEST_SLOPE):
            scored.append((0.0, theta, local))
            continue
        _, projected = NormalEquations.of(jacobian, d).step(estimate.plant.free, 1e-9)
        dd = float(np.vdot(d, d))
        rest = max(dd - projected, 1e-6 * dd)
        along = float(np.vdot(d, e))
        if along < 0 and amplitude is None:
            scored.append((0.0, theta, local))
            continue
        if amplitude is not None:
            parameter = plant.parameters_of(term)[amplitude]
            moved = start.values[amplitude] * along / rest
            theta[part.start + amplitude] = float(np.clip(moved, parameter.low, parameter.high))
        ratio = max(1 - (along / rest) * (along / ee), 1e-12)
        scored.append((-0.5 * baseline.n_errors * math.log(ratio), theta, local))
    return scored


def extend(
    baseline: Baseline, estimate: Estimate, term: Term, jacobian: Jacobian | None = None, max_steps: int = MAX_STEPS
) -> Estimate | None:
    """Fit the model with one effect more, from the starts with the best scores; None if none is worth it.

    The Jacobian is that of `estimate`; it is computed where it is needed and not given.
    """
    plant = baseline.plant.having([*(t for t in estimate.plant.terms if not term.replaces(t)), term])
    if term in plant.per_experiment:
        return baseline.fit(plant.terms, [plant.carry(estimate.plant, estimate.theta, estimate.local)], max_steps)
    if term.effect.moves_poles and plant.machine is None:
        thetas = [theta for theta, _ in started(estimate, plant, term)]
        fit = refit_from_poles(baseline.problem(plant), thetas, max_steps, TOLERANCE)
        if term.effect.hides_sign and plant.ny == 1:
            plain = unfolded(baseline.plant, baseline.train)
            theta, local = plant.carry(plain.plant, plain.theta, plain.local)
            theta[plant.n_linear :] = thetas[0][plant.n_linear :]
            return min(fit, baseline.fit(plant.terms, [(theta, local)], max_steps), key=lambda fit: fit.squares)
        if not term.effect.errors_grow or plant.per_experiment or fit.squares < STOOD_IN * baseline.squares:
            return fit
        # Multiple shooting (Bock, Recent advances in parameter identification techniques for ODE, 1983).
        of_pieces = refit_from_poles(baseline.in_pieces(plant), thetas, MAX_STEPS, TOLERANCE)
        return min(fit, baseline.fit(plant.terms, [(of_pieces.theta, None)], max_steps), key=lambda fit: fit.squares)
    jacobian = jacobian or jacobian_of(baseline, estimate)
    scored = sorted(score(baseline, estimate, plant, term, jacobian), key=lambda scored: -scored[0])
    if not scored or scored[0][0] < WORTH_A_REFIT:
        return None
    begun = [(theta, local) for _, theta, local in scored[:STARTS]]
    if plant.machine is not None and term.effect.role == "friction":
        # The damping stood in for it, and no descent leads from much of the one to much of the other.
        begun = begun[:1] + _without_damping(baseline, estimate, plant, term)
    return baseline.fit(plant.terms, begun, max_steps)


def _without_damping(
    baseline: Baseline, estimate: Estimate, plant: Plant, term: Term
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Begin a friction from each of its starts with little damping that stays as it is; return the best ones."""
    assert plant.machine is not None
    problem, damping = baseline.problem(plant), np.arange(plant.size) == DAMPING
    fits = [
        descend(problem, plant.machine.less_damped(theta), local, damping, FIRST_STEPS, TOLERANCE)
        for theta, local in started(estimate, plant, term)
    ]
    fits.sort(key=lambda fit: fit.squares)
    return [(fit.theta, fit.local) for fit in fits[:STARTS]]


def promising(
    baseline: Baseline, estimate: Estimate, terms: Sequence[Term], jacobian: Jacobian, count: int
) -> list[Term]:
    """Keep the terms with the best score tests; a machine that is known needs no other poles for any of them."""

    def best(term: Term) -> float:
        plant = baseline.plant.having([*(t for t in estimate.plant.terms if not term.replaces(t)), term])
        return max((scored[0] for scored in score(baseline, estimate, plant, term, jacobian)), default=0.0)

    return sorted(terms, key=best, reverse=True)[:count]


def add(baseline: Baseline, estimate: Estimate, term: Term) -> Estimate:
    """Fit the model with one effect more, whatever the score test says of it; none where it has nowhere to begin."""
    if not baseline.plant.starts_of(term):
        return estimate
    extended = extend(baseline, estimate, term)
    if extended is not None:
        return extended
    plant = baseline.plant.having([*estimate.plant.terms, term])
    return baseline.fit(plant.terms, started(estimate, plant, term))


def from_other_poles(baseline: Baseline, before: Estimate, fit: Estimate) -> Estimate:
    """Fit a model from other poles too where its last effect takes most of the squared error that was there before.

    The poles that the model had then stood in for the effect, and no descent may lead away from them.
    """
    if fit.squares > STOOD_IN * baseline.squares_of(before) or fit.plant.joint:
        return fit
    afresh = refit_from_poles(baseline.problem(fit.plant), [fit.theta], MAX_STEPS, TOLERANCE)
    return min(fit, afresh, key=lambda fit: fit.squares)


def jacobian_of(baseline: Baseline, estimate: Estimate) -> Jacobian:
    """Differentiate the simulation of a fitted model by its free parameters, on the training records."""
    return baseline.problem(estimate.plant).jacobian(estimate.theta, estimate.local, estimate.plant.free)


def started(estimate: Estimate, plant: Plant, term: Term) -> list[tuple[np.ndarray, np.ndarray]]:
    """Carry a fitted model over into a larger one, with the new term at each of its starts."""
    starts = []
    for start in plant.starts_of(term):
        theta, local = plant.carry(estimate.plant, estimate.theta, estimate.local)
        theta[plant.part_of(term)] = start.values
        starts.append((theta, local))
    return starts
