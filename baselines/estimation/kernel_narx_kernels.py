"""A NARX model with Gaussian kernels in free run."""

from __future__ import annotations

from math import exp

import numpy as np
from numba import njit


@njit(
    "(float64[:,::1], float64[:,::1], int64, int64, float64[:,::1], float64[:,::1], float64[:,::1], float64, float64)",
    cache=True,
)
def run_free(u, y, lags, nk, centres, weights, linear, gamma, bound):
    """Fill y [lags + T, ny] after its first `lags` rows, y(t) = linear (1, r) + sum_k w_k exp(-gamma |r - c_k|^2).

    r are the regressors of `monomials.regressors`; u [lags + T, nu]; linear [1 + n, ny], weights [m, ny], centres
    [m, n]. No y leaves +-bound.
    """
    ny, nu, n = y.shape[1], u.shape[1], centres.shape[1]
    r = np.empty(n)
    for t in range(lags, len(y)):
        for k in range(lags):
            for i in range(ny):
                r[k * ny + i] = y[t - 1 - k, i]
        for k in range(lags + 1 - nk):
            for j in range(nu):
                r[lags * ny + k * nu + j] = u[t - nk - k, j]
        for i in range(ny):
            y[t, i] = linear[0, i]
            for k in range(n):
                y[t, i] += linear[1 + k, i] * r[k]
        for k in range(len(centres)):
            square = 0.0
            for j in range(n):
                square += (r[j] - centres[k, j]) ** 2
            near = exp(-gamma * square)
            for i in range(ny):
                y[t, i] += weights[k, i] * near
        for i in range(ny):
            if not abs(y[t, i]) <= bound:
                y[t, i] = bound if y[t, i] > 0 else -bound
