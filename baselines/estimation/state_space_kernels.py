"""A linear state-space model in free run, and the response to a push on each of its states."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(
    "(float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], float64[::1])",
    cache=True,
)
def run(a, b, c, d, u, x0):
    """Give y [T, ny] and x [T, n] of x(t+1) = A x(t) + B u(t), y(t) = C x(t) + D u(t) from x(0) = x0; u [T, nu]."""
    length, n, nu, ny = len(u), len(a), u.shape[1], len(c)
    x, y = np.zeros((length, n)), np.zeros((length, ny))
    for t in range(length):
        for i in range(n):
            if t == 0:
                x[t, i] = x0[i]
                continue
            for j in range(n):
                x[t, i] += a[i, j] * x[t - 1, j]
            for j in range(nu):
                x[t, i] += b[i, j] * u[t - 1, j]
        for i in range(ny):
            for j in range(n):
                y[t, i] += c[i, j] * x[t, j]
            for j in range(nu):
                y[t, i] += d[i, j] * u[t, j]
    return y, x


@njit("float64[:,:,:,::1](float64[:,::1], float64[:,::1], float64[:,::1])", cache=True)
def pushed(a, c, signals):
    """Give [n, m, T, ny]: the output when signal j of [T, m] is added to state i of x(t+1) = A x(t), from rest."""
    length, m, n, ny = signals.shape[0], signals.shape[1], len(a), len(c)
    out = np.zeros((n, m, length, ny))
    moved, after = np.zeros((n, n)), np.zeros((n, n))  # [state, pushed state]
    for j in range(m):
        moved[:] = 0.0
        for t in range(length):
            for o in range(ny):
                for i in range(n):
                    total = 0.0
                    for k in range(n):
                        total += c[o, k] * moved[k, i]
                    out[i, j, t, o] = total
            for i in range(n):
                for k in range(n):
                    after[i, k] = 0.0
                for h in range(n):
                    weight = a[i, h]
                    for k in range(n):
                        after[i, k] += weight * moved[h, k]
                after[i, i] += signals[t, j]
            moved[:] = after
    return out
