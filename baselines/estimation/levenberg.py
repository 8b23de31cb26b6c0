"""Levenberg-Marquardt on normal equations, for costs that come with their Jacobian."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

PIECE = 8192
# A search that gains less than 1e-5 of the error in this many steps has ended.
CRAWL = 10


@dataclass(frozen=True, eq=False)
class Cost:
    """The sum of squares of an error e [n], half its gradient J' e [p], and J' J [p, p]."""

    squares: float
    gradient: Float[np.ndarray, " p"]
    hessian: Float[np.ndarray, "p p"]


def sum_up(linearised: Iterable[tuple[np.ndarray, np.ndarray]]) -> Cost:
    """The cost of errors e [..] with slopes de/dtheta [p, ..], group after group."""
    products = np.zeros((1, 1))  # of [e; de/dtheta] with itself
    for e, slope in linearised:
        rows = np.concatenate((e[None], slope)).reshape(len(slope) + 1, -1)
        # In pieces that stay in the cache and on one thread.
        for start in range(0, rows.shape[1], PIECE):
            piece = rows[:, start : start + PIECE]
            products = products + piece @ piece.T
    return Cost(float(products[0, 0]), products[0, 1:], products[1:, 1:])


@dataclass(frozen=True, eq=False)
class Minimum:
    """Where the search ended, what it cost there, and whether nothing was left to gain."""

    theta: Float[np.ndarray, " p"]
    cost: Cost
    converged: bool


def minimise(
    cost_at: Callable[[np.ndarray], Cost],
    theta: Float[np.ndarray, " p"],
    allowed: Callable[[np.ndarray], list[np.ndarray]],
    samples: int,
    max_steps: int = 200,
) -> Minimum:
    """Minimise |e(theta)|^2; `allowed` gives the stable points that may stand for a trial point.

    Converged is when the gain that the quadratic model promises, g' H^-1 g, is a millionth of the variance: then
    theta is within a thousandth of a standard error, whatever its scale (Ljung 1999, section 10.2; Marquardt 1963).
    """
    tolerance = 1e-6 / samples
    cost, damping = cost_at(theta), 1e-3
    history = [cost.squares]
    for _ in range(max_steps):
        scale = np.sqrt(np.diag(cost.hessian))
        scale[scale == 0] = 1.0
        hessian, gradient = cost.hessian / scale / scale[:, None], cost.gradient / scale
        promised = gradient @ np.linalg.lstsq(hessian, gradient, rcond=1e-14)[0]
        # The second rule ends a crawl along the edge of the stable region, where the promise is never kept.
        crawls = len(history) > CRAWL and history[-CRAWL - 1] - cost.squares <= 1e-5 * cost.squares
        if promised <= tolerance * cost.squares or crawls:
            return Minimum(theta, cost, True)
        while damping < 1e12:
            step = np.linalg.solve(hessian + damping * np.eye(len(theta)), gradient) / scale
            trials = [(point, cost_at(point)) for point in allowed(theta - step)]
            point, trial = min(trials, key=lambda pair: pair[1].squares)
            if trial.squares < cost.squares:
                theta, cost, damping = point, trial, max(damping / 10, 1e-12)
                history.append(cost.squares)
                break
            damping *= 4
        else:
            # No step downhill is left in floating point: a minimum, or a corner of the stable region.
            return Minimum(theta, cost, True)
    return Minimum(theta, cost, False)


def stable(polynomial: Float[np.ndarray, " n1"], radius: float = 1 - 1e-6) -> list[Float[np.ndarray, " n1"]]:
    """The monic polynomial in q^-1 itself when all its roots lie inside the circle of `radius`.

    Otherwise two that do: roots reflected (1/r for r, which keeps the shape of the spectrum and leads out of a
    corner), and roots moved onto the circle (which lets a search slide along it).
    """
    roots = np.roots(polynomial)
    size = np.maximum(np.abs(roots), 1e-300)
    if (size <= radius).all():
        return [polynomial]
    onto = np.minimum(size, radius)
    reflected = np.where(size > radius, np.minimum(1 / size, radius), size)
    return [np.real(np.poly(roots * moved / size)) for moved in (reflected, onto)]
