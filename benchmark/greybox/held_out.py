"""Errors on held-out records, block by block, and whether they fall."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.stats import wilcoxon

from simgap.greybox.fitting import Estimate, descend
from simgap.greybox.initial_states import initial_states, usual_start
from simgap.greybox.noise import Noise, white
from simgap.greybox.problem import Problem
from simgap.greybox.samples import RESOLUTION, Records

BLOCKS = 20
# Chance of a gain in held-out blocks where there is none; for normal gains, 1.3 standard errors of their mean.
BY_CHANCE = 0.1


def errors_on(fit: Estimate, records: Records, n_init: int, train: Records | None = None) -> np.ndarray:
    """Simulate other records with a fitted model, each from its first n_init samples: errors [E, T, ny].

    Given the records of its training, their usual start counts too, as it will in the test. A few noisy samples alone
    tell little of a slow state, and an order that has one would be blamed for its start.
    """
    noise = white(records.sizes)
    beginning = Problem(fit.plant, records.beginning(n_init), noise)
    start = initial_states(beginning, fit.theta)
    usual = usual_start(fit, train, noise, n_init) if train is not None else None
    if usual is not None:
        start = usual.beside(beginning, fit.theta, start)
    return Problem(fit.plant, records, noise).errors(fit.theta, start)


def block_errors(fit: Estimate, valid: Records, n_init: int, train: Records | None) -> np.ndarray:
    """Average the squared errors of held-out free runs, in units of the outputs' sizes, over about twenty blocks.

    They begin as `errors_on` does.
    """
    errors = errors_on(fit, valid, n_init, train) / valid.sizes
    squares = np.where(valid.mask[:, :, None], errors**2 + RESOLUTION**2, 0.0)
    blocks = np.array_split(squares, min(max(2, BLOCKS // len(squares)), squares.shape[1]), axis=1)
    return np.concatenate([block.mean(axis=(1, 2)) for block in blocks])


def on_other_records(problem: Problem, theta: np.ndarray) -> Estimate:
    """Simulate other records with fitted numbers, each from the start that suits it best."""
    return descend(problem, theta, fixed=np.ones(problem.plant.size, dtype=bool), max_steps=10)


def squares_of_blocks(problem: Problem, errors: np.ndarray) -> np.ndarray:
    """Sum the squares of errors, over the variance of the noise, block by block."""
    measured = problem.records.mask[:, :, None]
    squares = np.where(measured, problem.noise.whiten(errors) ** 2 + problem.least, 0.0)
    blocks = np.array_split(squares, max(2, BLOCKS // len(squares)), axis=1)
    return np.concatenate([block.sum(axis=(1, 2)) for block in blocks])


def gain_later(records: Records, noise: Noise, before: Estimate, after: Estimate) -> np.ndarray:
    """Compute what one model takes of another's squared errors in the second half of each record, block by block.

    What is estimated anew in a record is told by its first half.
    """
    middle = records.mask.shape[1] // 2
    first, second = records.mask.copy(), records.mask.copy()
    first[:, middle:] = second[:, :middle] = False
    left = []
    for fit in (before, after):
        of_first = on_other_records(Problem(fit.plant, replace(records, mask=first), noise), fit.theta)
        later = Problem(fit.plant, replace(records, mask=second), noise)
        left.append(squares_of_blocks(later, later.errors(fit.theta, of_first.local)))
    return left[0] - left[1]


def detrended(errors: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Take the straight line that fits best out of each record's errors [E, T, ny], as a drifting sensor adds one.

    SciPy's detrend knows no gaps between readings, and refuses the errors of a run without bound.
    """
    lines = np.stack([np.ones(mask.shape[1]), np.linspace(-1.0, 1.0, mask.shape[1])], axis=1)  # [T, 2]
    rest = errors.copy()
    for record, measured in zip(rest, mask, strict=True):
        basis = np.linalg.qr(lines[measured])[0]
        record[measured] -= basis @ (basis.T @ record[measured])
    return rest


def as_good_as_best(errors: Sequence[np.ndarray]) -> int:
    """Return the first of several models whose mean error is within a standard error of the lowest, block by block."""
    best = min(errors, key=np.mean)
    worse = [one - best for one in errors]
    return next(i for i, gap in enumerate(worse) if gap.mean() <= gap.std() / math.sqrt(len(gap)))


def in_most(gain: np.ndarray) -> bool:
    """Tell whether the errors of held-out blocks fall in the mean and by more than chance, by ranks (Wilcoxon 1945).

    A valve that slips once too often is far off until it moves again, in one block, and the mean alone goes by that.
    """
    if not gain.mean() > 0:  # nor is it a number
        return False
    by_chance: Any = wilcoxon(gain, alternative="greater")[1]
    return bool(by_chance < BY_CHANCE)
