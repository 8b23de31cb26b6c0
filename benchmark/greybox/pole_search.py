"""Fits that begin from a grid of poles: the plain linear model, and models with effects that move the poles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import combinations, combinations_with_replacement

import numpy as np

from simgap.cores import on_cores
from simgap.greybox import dynamics
from simgap.greybox.fitting import MAX_STEPS, Estimate, best_descent, descend
from simgap.greybox.noise import white, white_as_large_as
from simgap.greybox.plant import Plant
from simgap.greybox.problem import Problem
from simgap.greybox.samples import Records

FINALISTS = 2
STEPS_WITH_ZEROS = 6  # from given poles
FEW_STEPS = 10  # of a fit with effects until the finalists are compared
LARGEST_RATIO = 1e6


def fit_plain(
    plant: Plant,
    records: Records,
    smaller: Estimate | None = None,
    shapes: Sequence[list[float]] | None = None,
    of_terms: Sequence[float] = (),
) -> Estimate:
    """Fit a plain linear model from the best poles of a grid, or from those of a smaller model and one more.

    With a delay it is linear too; `of_terms` holds the parameters of the terms to begin with.
    """
    problem = _plain_problem(plant, records)
    begun = []
    # Given the poles, all but the zeros and the velocity's scale is linear: one step solves it. Where each further pole
    # comes with a zero, the zeros move along.
    with_zeros = smaller if smaller is not None and _gains_zeros(smaller.plant, plant) else None
    linear = np.zeros(plant.size, dtype=bool)
    linear[plant.layout.gains] = linear[plant.layout.offset] = True
    linear[plant.layout.zeros] = with_zeros is not None
    if shapes is None:
        shapes = list(
            denominator_grid(plant, records) if smaller is None else larger_denominators(plant, records, smaller)
        )
    for shape in shapes:
        theta = np.zeros(plant.size)
        theta[plant.layout.poles] = shape
        theta[plant.layout.velocity] = 1.0
        theta[plant.n_linear :] = of_terms
        if with_zeros is not None:
            theta[plant.layout.zeros] = _zeros_at_new_poles(plant, theta, with_zeros)
        begun.append(theta)
    steps = STEPS_WITH_ZEROS if with_zeros is not None else 2
    tried = on_cores(partial(descend, problem, fixed=~linear, max_steps=steps), begun)
    return _finished(problem, tried, FEW_STEPS if len(of_terms) else MAX_STEPS)


def fit_from(plant: Plant, records: Records, starts: Sequence[np.ndarray]) -> Estimate:
    """Fit a plain linear model from the best of given starts, whose gains and zeros are fitted first."""
    problem = _plain_problem(plant, records)
    fixed = np.zeros(plant.size, dtype=bool)
    fixed[plant.layout.poles] = True
    tried = on_cores(partial(descend, problem, fixed=fixed, max_steps=STEPS_WITH_ZEROS), starts)
    return _finished(problem, tried, MAX_STEPS)


def _plain_problem(plant: Plant, records: Records) -> Problem:
    spread = np.maximum(np.std(records.y[records.mask], axis=0), records.rounding)
    return Problem(plant, records, white(spread))


def _finished(problem: Problem, tried: list[Estimate], max_steps: int) -> Estimate:
    """Fit the best of these on; then again, the outputs weighed by how well they can be simulated."""
    plant, records = problem.plant, problem.records
    tried.sort(key=lambda fit: fit.squares)
    best = best_descent(problem, [(fit.theta, fit.local) for fit in tried[:FINALISTS]], max_steps)
    noise = white_as_large_as(best.errors, records.mask, records.resolution)
    return descend(Problem(plant, records, noise), best.theta, best.local)


def _gains_zeros(smaller: Plant, plant: Plant) -> bool:
    return 0 < plant.order - smaller.order == plant.zeros - smaller.zeros


def _zeros_at_new_poles(plant: Plant, theta: np.ndarray, smaller: Estimate) -> np.ndarray:
    """Begin as the smaller model: with its zeros, and one in the place of each pole that it does not have."""
    denominators = (
        np.array([1.0, *-dynamics.matrix(p, t)[-1, ::-1]]) for p, t in ((plant, theta), (smaller.plant, smaller.theta))
    )
    new, rest = np.polydiv(*denominators)
    zeros = np.array([1.0, *smaller.theta[smaller.plant.layout.zeros]])  # c_0 + c_1 s + ..
    if new[-1] and np.allclose(rest, 0.0, atol=1e-9 * np.max(np.abs(new))):
        zeros = np.convolve(zeros, new[::-1] / new[-1])
    return np.pad(zeros[1:], (0, plant.zeros + 1 - len(zeros)))


def refit_from_poles(
    problem: Problem, starts: list[np.ndarray], max_steps: int, tolerance: float, amplitudes: Sequence[int] = ()
) -> Estimate:
    """Fit from a coarse grid of poles; each of `starts` is a theta whose terms are kept but for these amplitudes."""
    plant, records = problem.plant, problem.records
    gains = np.zeros(plant.size, dtype=bool)
    gains[plant.layout.gains] = gains[plant.layout.offset] = gains[list(amplitudes)] = True
    begun = []
    poles = starts[0][plant.layout.poles]
    if plant.machine:
        shapes = plant.machine.shapes(starts[0])
    elif plant.order <= 2:
        shapes = list(denominator_grid(plant, records, coarse=True))
    else:  # those of a joint were found with its effects beside them
        shapes = [list(scale * poles) for scale in ((1.0,) if plant.joint else (0.25, 0.5, 1.0, 2.0))]
    for shape in shapes:
        for start in starts:
            theta = start.copy()
            theta[plant.layout.poles] = shape
            if not plant.imposed and plant.machine is None:
                theta[: plant.n_linear] = _same_gain(plant, start, theta)
            begun.append(theta)
    tried = on_cores(partial(descend, problem, fixed=~gains, max_steps=2, tolerance=1.0), begun)
    tried.sort(key=lambda fit: fit.squares)
    best = best_descent(problem, [(fit.theta, fit.local) for fit in tried[:FINALISTS]], max_steps, tolerance)
    return descend(problem, best.theta, best.local) if plant.sign_hidden else best


def _same_gain(plant: Plant, before: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Scale the gains so that the steady gain stays what it was with other poles."""
    now, then = (abs(float(np.linalg.det(dynamics.matrix(plant, values)))) for values in (theta, before))
    if plant.cascade:  # inflow in units of the last tank
        now, then = float(theta[plant.order - 1]), float(before[plant.order - 1])
    # An integrator has no steady gain, and what comes near it none that is worth keeping.
    ratio = min(now / then, LARGEST_RATIO) if then else 1.0
    theta = theta.copy()
    theta[plant.layout.gains] = before[plant.layout.gains] * ratio
    theta[plant.layout.offset] = 0.0
    return theta[: plant.n_linear]


def denominator_grid(plant: Plant, records: Records, coarse: bool = False) -> Iterator[list[float]]:
    """List section coefficients from the fastest that the sampling shows to the slowest that the records do."""
    dt, duration = records.dt, records.duration
    rates = np.geomspace((3 if coarse else 0.5) / duration, (0.3 if coarse else 1.5) / dt, 5 if coarse else 8)
    if plant.cascade:
        choose = combinations_with_replacement if coarse else combinations
        yield from (list(chosen) for chosen in choose(rates[::-1], plant.order))
    elif plant.order <= 1:
        yield from ([rate][: plant.order] for rate in rates[: 1 if plant.imposed else None])
    elif plant.order == 2 and plant.high[1] == 0:  # an effect stands in the place of the spring
        yield from ([rate, 0.0] for rate in rates)
    else:
        sections = [[2 * damping * w, w * w] for w in np.geomspace(2 / duration, 2.5 / dt, 9)
                    for damping in (0.05, 0.3, 1.0)]  # fmt: skip
        sections += [[rate, 0.0] for rate in rates[1::2]]
        yield from sections


def larger_denominators(plant: Plant, records: Records, smaller: Estimate) -> Iterator[list[float]]:
    """List the poles of a model of lower order with further ones; zeros come after the same poles without them."""
    before = list(smaller.theta[smaller.plant.layout.poles])
    rates = np.geomspace(0.5 / records.duration, 1.5 / records.dt, 5)
    frequencies = np.geomspace(2 / records.duration, 2.5 / records.dt, 7)
    swinging = [(2 * damping * w, w * w) for w in frequencies for damping in (0.05, 0.4)]
    if plant.order == len(before):
        yield before
    elif plant.cascade:
        yield from (sorted([*before, rate], reverse=True) for rate in rates)
    elif len(before) % 2 == 0:
        # With a further real pole; or the slow part of the last section stays, and beside it something swings.
        yield from ([*before, rate] for rate in rates)
        slow = before[-1] / before[-2] if before[-2] > 0 else 0.0
        yield from ([*before[:-2], *section, slow] for section in swinging)
    else:
        # The last first-order section becomes one of second order: with a further real pole, or swinging.
        rest, last = before[:-1], before[-1]
        yield from ([*rest, last + rate, last * rate] for rate in rates)
        yield from ([*rest, *section] for section in swinging)
