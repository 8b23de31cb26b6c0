"""Errors on held-out records, block by block, and whether they fall."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.stats import wilcoxon

from simgap.greybox.fitting import Estimate
from simgap.greybox.initial_states import initial_states
from simgap.greybox.noise import white
from simgap.greybox.problem import Problem
from simgap.greybox.samples import RESOLUTION, Records

BLOCKS = 20
# Chance of a gain in held-out blocks where there is none; for normal gains, 1.3 standard errors of their mean.
BY_CHANCE = 0.1


def errors_on(fit: Estimate, records: Records, n_init: int) -> np.ndarray:
    """Simulate other records with a fitted model, each from its first n_init samples: errors [E, T, ny]."""
    noise = white(records.sizes)
    start = initial_states(Problem(fit.plant, records.beginning(n_init), noise), fit.theta)
    return Problem(fit.plant, records, noise).errors(fit.theta, start)


def block_errors(fit: Estimate, valid: Records, n_init: int) -> np.ndarray:
    """Average the squared errors of held-out free runs, in units of the outputs' sizes, over about twenty blocks."""
    errors = errors_on(fit, valid, n_init) / valid.sizes
    squares = np.where(valid.mask[:, :, None], errors**2 + RESOLUTION**2, 0.0)
    blocks = np.array_split(squares, min(max(2, BLOCKS // len(squares)), squares.shape[1]), axis=1)
    return np.concatenate([block.mean(axis=(1, 2)) for block in blocks])


def in_most(gain: np.ndarray) -> bool:
    """Tell whether the errors of held-out blocks fall in the mean and by more than chance, by ranks (Wilcoxon 1945).

    A valve that slips once too often is far off until it moves again, in one block, and the mean alone goes by that.
    """
    if not gain.mean() > 0:  # nor is it a number
        return False
    by_chance: Any = wilcoxon(gain, alternative="greater")[1]
    return bool(by_chance < BY_CHANCE)
