"""The one compiled loop behind every linear simulation and prediction."""

from __future__ import annotations

import numpy as np
from numba import njit


# Compiled, or read from the cache, when this file is imported, so that no fit is timed with the compiler's work.
@njit("float64[:,:,::1](float64[:,:,::1], float64[:,:,::1], float64[:,:,::1], float64[:,:,::1])", cache=True)
def filter_matrix(a, b, u, z):
    """Run A(q) y = B(q) u from the state z: a [N, ny, ny] lags 1..N, b [M, ny, nu] lags 0..M-1, u [B, T, nu],
    z [B, N, ny], the part of the first N outputs that comes from before the record. Returns y [B, T, ny].
    """
    batch, length, nu = u.shape
    order, ny = a.shape[0], a.shape[1]
    y = np.zeros((batch, length, ny))
    for s in range(batch):
        y[s, : min(order, length)] = z[s, :length]
        for i in range(ny):
            for j in range(nu):
                for k in range(b.shape[0]):
                    coefficient = b[k, i, j]
                    if coefficient != 0.0:
                        for t in range(k, length):
                            y[s, t, i] += coefficient * u[s, t - k, j]
        for t in range(length):
            for i in range(ny):
                value = y[s, t, i]
                # The newest output comes last, so that each sample waits for one multiplication only.
                for k in range(min(order, t), 0, -1):
                    for j in range(ny):
                        value -= a[k - 1, i, j] * y[s, t - k, j]
                y[s, t, i] = value
    return y
