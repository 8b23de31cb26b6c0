"""Candidates for the next effect: which apply, and what each promises by its score test."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from simgap.cores import on_cores
from simgap.greybox.baseline import Baseline
from simgap.greybox.effects.effect import Effect
from simgap.greybox.fitting import Estimate
from simgap.greybox.kernels import SLOTS
from simgap.greybox.normal_equations import LARGEST_SLOPE, Jacobian, NormalEquations
from simgap.greybox.plant import Plant
from simgap.greybox.terms import Term
from simgap.registry import EFFECTS

STARTS = 2  # of an effect that are refitted: those with the best scores

Scored = tuple[float, np.ndarray, np.ndarray]  # what a start would gain, theta, numbers of each experiment


def candidates(baseline: Baseline, terms: Sequence[Term] = ()) -> list[Term]:
    """List every effect that applies to the plant, has where to begin and room beside `terms`, on every channel."""
    plant, scales = baseline.plant, baseline.plant.scales
    assert scales is not None
    taken = {term.key for term in terms}
    contained = {name for term in terms for name in term.effect.contains}
    listed = []
    for law in [law for name in EFFECTS.names() if name not in contained for law in _laws(EFFECTS[name], baseline)]:
        channels = {"input": plant.input_channels, "force": range(1), "output": range(plant.ny)}[law.port]
        on_channels = [Term(law, channel) for channel in channels if plant.takes(law, channel)]
        listed += [
            t for t in on_channels
            if t.key not in taken and law.suits(scales.of(t))
            and _has_room(t, terms)
        ]  # fmt: skip
    return listed


def _laws(effect: type[Effect], baseline: Baseline) -> list[Effect]:
    """List the laws of a cause that the number of experiments allows."""
    if not effect.simulated:
        return []
    if effect.own and not baseline.repeated:
        return [effect.steady()] if effect.steady else []
    return [effect(), effect.of_each()] if effect.of_each else [effect()]


def _has_room(term: Term, terms: Sequence[Term]) -> bool:
    """Tell whether the compiled loop has room for this force beside those of other terms."""
    return not term.in_loop or sum(other.in_loop and not term.replaces(other) for other in terms) < SLOTS


def score_tests(baseline: Baseline, estimate: Estimate, terms: Sequence[Term]) -> list[list[Scored]]:
    """Test each of several effects beside a fitted model, as `score` does."""
    jacobian = baseline.problem(estimate.plant).jacobian(estimate.theta, estimate.local, estimate.plant.free)
    white = baseline.noise.whiten(estimate.errors).reshape(len(estimate.local), -1)  # [E, M]
    normal = NormalEquations.of(jacobian, white) if jacobian.finite else None
    return on_cores(partial(score, baseline, estimate, jacobian, normal), terms)


def score(
    baseline: Baseline, estimate: Estimate, jacobian: Jacobian, normal: NormalEquations | None, term: Term
) -> list[Scored]:
    """Test each start of an effect: the log-likelihood it would gain, to first order, with theta and local numbers.

        d = simulation with the effect - simulation without, made orthogonal to the model's own slopes
        gain = -N/2 log(1 - (d' e)^2 / (d' d  e' e))

    Where d grows in proportion to a parameter, the start moves to the amplitude that fits best (Rao 1948). The best
    start comes first. Nothing is said of an effect that moves the poles, which no step from these poles shows, nor of
    one with numbers for each experiment.
    """
    noise, plant = baseline.noise, with_term(estimate.plant, term)
    if term in plant.per_experiment or (term.effect.moves_poles and plant.machine is None):
        return []
    e = noise.whiten(estimate.errors).reshape(len(estimate.local), -1)
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
        if normal is None or not 1 / LARGEST_SLOPE < np.max(np.abs(d)) < LARGEST_SLOPE:
            scored.append((0.0, theta, local))
            continue
        _, projected = normal.with_errors(jacobian, d).step(estimate.plant.free, 1e-9)
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
        ratio = max(1 - (along / rest) * (along / estimate.squares), 1e-12)
        scored.append((-0.5 * baseline.n_errors * math.log(ratio), theta, local))
    return sorted(scored, key=lambda one: -one[0])


def with_term(plant: Plant, term: Term) -> Plant:
    """Return a plant with one term more, which may stand in the place of others."""
    return plant.having([*(other for other in plant.terms if not term.replaces(other)), term])
