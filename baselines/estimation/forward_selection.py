"""Forward regression: terms in the order in which they reduce the error of a least-squares fit."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

TINY = 1e-10  # a column with no more left than this share of its square is a combination of those chosen


def forward_selection(
    products: Float[np.ndarray, "M M"], targets: Float[np.ndarray, " M"], most: int
) -> Int[np.ndarray, " p"]:
    """Choose up to `most` columns by their error reduction ratio, from Phi' Phi and Phi' y.

    At each step the column whose part orthogonal to those chosen explains most of what is left of y: orthogonal least
    squares by Gram-Schmidt (Chen, Billings and Luo 1989), done on the products.
    """
    left, gains, chosen = products.copy(), targets.copy(), []
    squares = np.diag(products).copy()
    for _ in range(min(most, len(targets))):
        size = np.diag(left)
        free = size > TINY * squares
        free[chosen] = False
        if not free.any():
            break
        ratio = np.where(free, gains**2 / np.where(free, size, 1.0), 0.0)
        best = int(np.argmax(ratio))
        chosen.append(best)
        direction = left[:, best] / size[best]
        gains = gains - direction * gains[best]
        left = left - np.outer(direction, left[best])
    return np.array(chosen)
