"""The plain linear model by simulation error: no delay, no effect, found from a grid of poles."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, combinations_with_replacement

import numpy as np

from simgap.greybox.fitting import Estimate, Problem, Records
from simgap.greybox.noise import white
from simgap.greybox.plant import Structure

FINALISTS = 2


def fit_plain(structure: Structure, records: Records, smaller: Estimate | None = None) -> Estimate:
    """The best of several searches from the most promising poles of a grid, or of a smaller model and one more."""
    problem = Problem(structure, records, white(np.std(records.y[records.mask], axis=0) + 1e-12))
    tried = []
    # Given the poles, all but the zeros and the velocity's scale is linear: one step solves it.
    linear = np.zeros(structure.size, dtype=bool)
    linear[structure.at[1]] = linear[structure.at[2]] = True
    for shape in poles(structure, records) if smaller is None else extended(structure, records, smaller):
        theta = np.zeros(structure.size)
        theta[structure.at[0]] = shape
        theta[structure.at[4]] = 1.0
        solved = problem.fit(theta, fixed=~linear, max_steps=2)
        tried.append((solved.squares, solved.theta, solved.local))
    tried.sort(key=lambda trial: trial[0])
    fits = [problem.fit(theta, local) for _, theta, local in tried[:FINALISTS]]
    best = min(fits, key=lambda fit: fit.squares)
    # The outputs are weighed by how well they can be simulated.
    deviations = np.sqrt(np.mean(best.errors[records.mask] ** 2, axis=0)) + 1e-12
    return Problem(structure, records, white(deviations)).fit(best.theta, best.local)


def refit_from_poles(problem: Problem, starts: list[np.ndarray]) -> Estimate:
    """The best fit from a coarse grid of poles; each of `starts` is a theta whose terms are kept."""
    structure, records = problem.structure, problem.records
    gains = np.zeros(structure.size, dtype=bool)
    gains[structure.at[1]] = gains[structure.at[2]] = True
    tried = []
    few = structure.order <= 2
    shapes = list(poles(structure, records, coarse=True)) if few else [
        [a * scale for a in starts[0][structure.at[0]]] for scale in (0.25, 0.5, 1.0, 2.0)
    ]  # fmt: skip
    for shape in shapes:
        for start in starts:
            theta = start.copy()
            theta[structure.at[0]] = shape
            theta[: structure.n_plant] = _same_gain(structure, start, theta)
            tried.append(problem.fit(theta, fixed=~gains, max_steps=5, tolerance=1.0))
    tried.sort(key=lambda trial: trial.squares)
    fits = [problem.fit(trial.theta, trial.local) for trial in tried[:FINALISTS]]
    best = min(fits, key=lambda fit: fit.squares)
    return problem.fit(best.theta, best.local) if structure.signless else best


def _same_gain(structure: Structure, before: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """The plant's parameters with other poles and the steady gain of before, at the input's zero."""
    ratio = abs(np.linalg.det(structure.matrix(theta)) / (np.linalg.det(structure.matrix(before)) or 1.0))
    if structure.cascade:  # inflow in units of the last tank
        ratio = theta[structure.order - 1] / (before[structure.order - 1] or 1.0)
    theta = theta.copy()
    theta[structure.at[1]] = before[structure.at[1]] * ratio
    theta[structure.at[2]] = 0.0
    return theta[: structure.n_plant]


def poles(structure: Structure, records: Records, coarse: bool = False) -> Iterator[list[float]]:
    """Shapes from the fastest that the sampling shows to the slowest that the records do."""
    dt, duration = records.dt, records.duration
    rates = np.geomspace((3 if coarse else 0.5) / duration, (0.3 if coarse else 1.5) / dt, 5 if coarse else 8)
    if structure.cascade:
        choose = combinations_with_replacement if coarse else combinations
        yield from (list(chosen) for chosen in choose(rates[::-1], structure.order))
    elif structure.order == 1:
        yield from ([rate] for rate in rates)
    else:
        sections = [[2 * damping * w, w * w] for w in np.geomspace(2 / duration, 2.5 / dt, 9)
                    for damping in (0.05, 0.3, 1.0)]  # fmt: skip
        sections += [[rate, 0.0] for rate in rates[1::2]]
        yield from sections


def extended(structure: Structure, records: Records, smaller: Estimate) -> Iterator[list[float]]:
    """The poles of a model of lower order and further ones; zeros come after the same poles without them."""
    before = list(smaller.theta[smaller.structure.at[0]])
    rates = np.geomspace(0.5 / records.duration, 1.5 / records.dt, 5)
    if structure.order == len(before):
        yield before
    elif structure.cascade:
        yield from (sorted([*before, rate], reverse=True) for rate in rates)
    elif len(before) % 2 == 0:
        yield from ([*before, rate] for rate in rates)
    else:
        # The last first-order section becomes one of second order: with a further real pole, or swinging.
        rest, last = before[:-1], before[-1]
        yield from ([*rest, last + rate, last * rate] for rate in rates)
        yield from ([*rest, 2 * damping * w, w * w] for w in np.geomspace(2 / records.duration, 2.5 / records.dt, 7)
                    for damping in (0.05, 0.4))  # fmt: skip
