"""A polynomial difference equation in free run, with the sensitivity to every coefficient."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(
    "(float64[:,::1], float64[:,::1], float64[:,:,::1], int64, int64, float64[:,::1], float64[::1], int64[:,::1],"
    "int64[::1], float64[::1], float64)",
    cache=True,
)
def run_free(u, y, s, lags, nk, past, base, terms, owner, theta, bound):  # noqa: PLR0912  # one loop over time
    """Fill y [lags + T, ny] after its first `lags` rows: y_i(t) = sum of theta_k times term k, for the k of output i.

    Terms are products of past (y(t-1), .., y(t-lags)) and of past (u(t-nk), ..), `past` [lags+1, lags+1] being 1 or
    what makes differences of them; base [lags] (y(t-1), ..) is added. u [lags + T, nu]. s [lags + T, ny, p], where it
    is as long as y, is filled with dy/dtheta. No y leaves +-bound.
    """
    ny, nu, count, degree = y.shape[1], u.shape[1], len(theta), terms.shape[1]
    own = lags * ny
    r = np.ones(1 + own + (lags + 1 - nk) * nu)
    slope = np.zeros((ny, own))
    with_slopes = s.shape[0] == y.shape[0]
    for t in range(lags, len(y)):
        for k in range(lags):
            for i in range(ny):
                r[1 + k * ny + i] = 0.0
                for h in range(lags):
                    r[1 + k * ny + i] += past[k, h] * y[t - 1 - h, i]
        for k in range(lags + 1 - nk):
            for j in range(nu):
                r[1 + own + k * nu + j] = 0.0
                for h in range(lags + 1 - nk):
                    r[1 + own + k * nu + j] += past[k, h] * u[t - nk - h, j]
        for i in range(ny):
            y[t, i] = 0.0
            for h in range(lags):
                y[t, i] += base[h] * y[t - 1 - h, i]
            for k in range(own):
                slope[i, k] = 0.0
        for k in range(count):
            i = owner[k]
            value = 1.0
            for d in range(degree):
                value *= r[terms[k, d]]
            y[t, i] += theta[k] * value
            if with_slopes:
                s[t, i, k] += value
                for d in range(degree):
                    at = terms[k, d]
                    if 0 < at <= own:
                        rest = theta[k]
                        for e in range(degree):
                            if e != d:
                                rest *= r[terms[k, e]]
                        slope[i, at - 1] += rest
        if with_slopes:
            for i in range(ny):
                for k in range(lags):
                    for j in range(ny):
                        weight = base[k] if i == j else 0.0
                        for h in range(lags):
                            weight += past[h, k] * slope[i, h * ny + j]
                        if weight != 0.0:
                            for p in range(count):
                                s[t, i, p] += weight * s[t - 1 - k, j, p]
        for i in range(ny):
            if not abs(y[t, i]) <= bound:
                y[t, i] = bound if y[t, i] > 0 else -bound
                for p in range(count if with_slopes else 0):
                    s[t, i, p] = 0.0
