"""Levenberg-Marquardt for groups of unknowns that do not depend on each other, each with a damping of its own."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

MOST_DAMPED = 1e10
SHORT, SHORT_STEPS = 0.1, 3


@runtime_checkable
class Descent(Protocol):
    """Sums of squares of G independent groups, with the point where each of them stands."""

    squares: Float[np.ndarray, " G"]
    samples: np.ndarray  # [G], errors in each group

    def linearise(self, groups: np.ndarray) -> Float[np.ndarray, " g"]:
        """Linearise these groups and return the gain that each promises, NaN where the slopes are no numbers."""
        ...

    def attempt(self, groups: np.ndarray, damping: Float[np.ndarray, " g"]) -> Float[np.ndarray, " g"]:
        """Try a damped step of each of these groups and return the squares there."""
        ...

    def accept(self, groups: np.ndarray, squares: Float[np.ndarray, " g"]) -> None:
        """Move these groups to where they were tried."""
        ...


def minimise(descent: Descent, max_steps: int, tolerance: float) -> Bool[np.ndarray, " G"]:
    """Minimise the squares of every group, and tell which converged (Marquardt 1963; Ljung 1999, section 10.2).

    A group has converged when the quadratic model promises less than `tolerance` of the variance of its errors, when
    three steps in a row gained less than a tenth of that, the last one a millionth of it, or when no step downhill is
    left in floating point.
    """
    damping, converged = np.full(len(descent.squares), 1e-3), np.zeros(len(descent.squares), dtype=bool)
    short = np.zeros(len(descent.squares), dtype=int)  # steps in a row that gained next to nothing
    active = np.flatnonzero(np.isfinite(descent.squares))
    for _ in range(max_steps):
        if not len(active):
            break
        promised = descent.linearise(active)
        least = tolerance * descent.squares / np.maximum(1, descent.samples)
        worth = promised > least[active]
        converged[active[~worth & np.isfinite(promised)]] = True
        active = active[worth]
        moved, trying = np.zeros(len(active), dtype=bool), np.arange(len(active))
        while len(trying):
            groups = active[trying]
            before, now = descent.squares[groups].copy(), descent.attempt(groups, damping[groups])
            better = now < before
            good, bad = groups[better], groups[~better]
            descent.accept(good, now[better])
            gained = before[better] - now[better]
            moved[trying[better]] = gained >= 1e-6 * tolerance * before[better]
            short[good] = np.where(gained < SHORT * least[good], short[good] + 1, 0)
            damping[good] = np.maximum(damping[good] / 10, 1e-12)
            damping[bad] = np.maximum(damping[bad] * 6, 1e-6)
            trying = trying[~better][damping[bad] < MOST_DAMPED]
        moved &= short[active] < SHORT_STEPS
        converged[active[~moved]] = True
        active = active[moved]
    return converged
