"""The plain linear model by simulation error: no delay, no effect, found from a grid of poles."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from simgap.baselines.grey.least_squares import Estimate, Problem, Records
from simgap.baselines.grey.noise import white
from simgap.baselines.grey.structure import Structure

FINALISTS = 3


def fit_plain(structure: Structure, records: Records) -> Estimate:
    """The best of several searches from the most promising poles of a grid."""
    problem = Problem(structure, records, white(np.std(records.y[records.mask], axis=0) + 1e-12))
    tried = []
    # Given the poles, all but the zeros and the velocity's scale is linear: one step solves it.
    linear = np.zeros(structure.size, dtype=bool)
    linear[structure.at[1]] = linear[structure.at[2]] = True
    for shape in poles(structure, records):
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


def poles(structure: Structure, records: Records) -> Iterator[list[float]]:
    """Shapes from the fastest that the sampling shows to the slowest that the records do."""
    dt, duration = records.dt, records.duration
    rates = np.geomspace(0.5 / duration, 1.5 / dt, 8)
    if structure.cascade:
        yield from (list(chosen) for chosen in combinations(rates[::-1], structure.order))
    elif structure.order == 1:
        yield from ([rate] for rate in rates)
    else:
        sections = [[2 * damping * w, w * w] for w in np.geomspace(2 / duration, 2.5 / dt, 9)
                    for damping in (0.05, 0.3, 1.0)]  # fmt: skip
        sections += [[rate, 0.0] for rate in rates[1::2]]
        if structure.order == 2:
            yield from sections
        elif structure.order == 3:
            yield from ([*section, rate] for section in sections[::2] for rate in rates[1::2])
        else:
            yield from ([*one, *other] for one, other in combinations(sections[::3], 2))
