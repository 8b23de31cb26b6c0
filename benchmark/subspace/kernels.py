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


@njit("float64[:,:,:,::1](float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1])", cache=True)
def pushed(a, c, x, u):
    """Give [n, m, T, ny]: the output when a signal is added to state i of x(t+1) = A x(t), from rest; A in blocks.

    The signals are the two states [T, n] of the block of i, where x has columns, and then the inputs [T, nu].
    """
    length, n, nu, ny = u.shape[0], len(a), u.shape[1], len(c)
    own = 2 if x.shape[1] else 0
    out = np.zeros((n, own + nu, length, ny))
    for i in range(n):
        first = i - i % 2
        last = min(first + 1, n - 1)
        for j in range(own + nu):
            if j < own and first + j > last:
                continue
            one, two = 0.0, 0.0
            for t in range(length):
                for o in range(ny):
                    out[i, j, t, o] = c[o, first] * one + (c[o, last] * two if last > first else 0.0)
                signal = x[t, first + j] if j < own else u[t, j - own]
                after = a[first, first] * one + (a[first, last] * two if last > first else 0.0)
                two = a[last, first] * one + a[last, last] * two
                one = after
                if i == first:
                    one += signal
                else:
                    two += signal
    return out
