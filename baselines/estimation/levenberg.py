"""Levenberg-Marquardt on normal equations, for costs that come with their Jacobian."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

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


@runtime_checkable
class Equation(Protocol):
    """An error e(theta) whose squares are to be as small as they can be."""

    @property
    def samples(self) -> int:
        """How many errors count."""
        ...

    def squares(self, theta: Float[np.ndarray, " p"]) -> float:
        """|e|^2, which takes a fraction of the time of the Jacobian."""
        ...

    def cost(self, theta: Float[np.ndarray, " p"]) -> Cost:
        """|e|^2, half its gradient and J' J."""
        ...

    def allowed(self, theta: Float[np.ndarray, " p"]) -> list[Float[np.ndarray, " p"]]:
        """Give the stable points that may stand for a trial point."""
        ...


def sum_up(linearised: Iterable[tuple[np.ndarray, np.ndarray]]) -> Cost:
    """Accumulate the cost of errors e [..] and their Jacobians de/dtheta [p, ..] over batches."""
    products = np.zeros((1, 1))  # of [e; de/dtheta] with itself
    for e, jacobian in linearised:
        rows = np.concatenate((e[None], jacobian)).reshape(len(jacobian) + 1, -1)
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


def minimise(equation: Equation, theta: Float[np.ndarray, " p"], max_steps: int = 200) -> Minimum:
    """Minimise |e(theta)|^2 over the stable points.

    Converged is when the gain that the quadratic model predicts, g' H^-1 g, is a millionth of the variance: then
    theta is within a thousandth of a standard error, whatever its scale (Ljung 1999, section 10.2; Marquardt 1963).
    """
    tolerance = 1e-6 / equation.samples
    cost, damping = equation.cost(theta), 1e-3
    history = [equation.squares(theta)]  # not those of the costs, which are rounded in another way
    for _ in range(max_steps):
        squares = history[-1]
        scale = np.sqrt(np.diag(cost.hessian))
        scale[scale == 0] = 1.0
        hessian, gradient = cost.hessian / scale / scale[:, None], cost.gradient / scale
        predicted = gradient @ np.linalg.lstsq(hessian, gradient, rcond=1e-14)[0]
        # The second rule ends a crawl along the edge of the stable region, where the predicted gain is never reached.
        crawls = len(history) > CRAWL and history[-CRAWL - 1] - squares <= 1e-5 * squares
        if predicted <= tolerance * squares or crawls:
            return Minimum(theta, cost, True)
        while damping < 1e12:
            step = np.linalg.solve(hessian + damping * np.eye(len(theta)), gradient) / scale
            trials = [(equation.squares(point), point) for point in equation.allowed(theta - step)]
            trial, point = min(trials, key=lambda pair: pair[0])
            if trial < squares:
                theta, cost, damping = point, equation.cost(point), max(damping / 10, 1e-12)
                history.append(trial)
                break
            damping *= 4
        else:
            # No step downhill is left in floating point: a minimum, or a corner of the stable region.
            return Minimum(theta, cost, True)
    return Minimum(theta, cost, False)


def stable(polynomial: Float[np.ndarray, " n1"], radius: float = 1 - 1e-6) -> list[Float[np.ndarray, " n1"]]:
    """Give the monic polynomial in q^-1 itself if all its roots lie inside the circle of `radius`, else two that do.

    Those have the outer roots reflected (1/r for r, which keeps the shape of the spectrum and leads out of a
    corner), or moved onto the circle (which lets a search slide along it).
    """
    roots = np.roots(polynomial)
    size = np.maximum(np.abs(roots), 1e-300)
    if (size <= radius).all():
        return [polynomial]
    onto = np.minimum(size, radius)
    reflected = np.where(size > radius, np.minimum(1 / size, radius), size)
    return [np.real(np.poly(roots * moved / size)) for moved in (reflected, onto)]
