"""Sequentially thresholded least squares: the sparse regression of SINDy."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

ROUNDS = 20


def thresholded(
    products: Float[np.ndarray, "M M"], targets: Float[np.ndarray, " M"], threshold: float, ridge: float = 0.0
) -> Float[np.ndarray, " M"]:
    """Fit y = Phi theta from Phi' Phi and Phi' y, dropping coefficients below `threshold` until none is left to drop.

    STLSQ (Brunton, Proctor and Kutz 2016), with `ridge` on the squares of the coefficients.
    """
    theta, kept = np.zeros(len(targets)), np.ones(len(targets), dtype=bool)
    for _ in range(ROUNDS):
        theta[:] = 0.0
        inner = products[np.ix_(kept, kept)] + ridge * np.eye(int(kept.sum()))
        theta[kept] = np.linalg.lstsq(inner, targets[kept], rcond=1e-14)[0]
        small = kept & (np.abs(theta) < threshold)
        if not small.any():
            break
        kept &= ~small
    return np.where(kept, theta, 0.0)
