"""Cubic splines on even knots, straight beyond the outermost: the static nonlinearity of a block model."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit("Tuple((int64, float64, UniTuple(float64, 4), UniTuple(float64, 4)))(float64, int64)", cache=True)
def _pieces(place, count):
    """Find interval k and the part of x beyond the knots, and there the four B-splines that are not zero and slopes."""
    inside = min(max(place, 0.0), count - 3.0)
    k = min(int(inside), count - 4)
    r = inside - k
    s = 1.0 - r
    values = (s**3 / 6, (3 * r**3 - 6 * r**2 + 4) / 6, (3 * s**3 - 6 * s**2 + 4) / 6, r**3 / 6)
    slopes = (-(s**2) / 2, (3 * r**2 - 4 * r) / 2, -(3 * s**2 - 4 * s) / 2, r**2 / 2)
    return k, place - inside, values, slopes


@njit("UniTuple(float64[::1], 2)(float64[::1], float64, float64, float64[::1])", cache=True)
def spline(x, low, step, c):
    """Evaluate f(x) = sum_k c_k B_k(x) and its slope at x [n]; c [K] spans K - 3 intervals of length `step` from `low`.

    Cubic B-splines (de Boor 1978, chapter 9); outside the knots f goes on as a straight line.
    """
    count = len(c)
    f, df = np.empty(len(x)), np.empty(len(x))
    for t in range(len(x)):
        k, beyond, values, slopes = _pieces((x[t] - low) / step, count)
        value = values[0] * c[k] + values[1] * c[k + 1] + values[2] * c[k + 2] + values[3] * c[k + 3]
        slope = slopes[0] * c[k] + slopes[1] * c[k + 1] + slopes[2] * c[k + 2] + slopes[3] * c[k + 3]
        f[t], df[t] = value + beyond * slope, slope / step
    return f, df


@njit("float64[:,::1](float64[::1], float64, float64, int64)", cache=True)
def basis(x, low, step, count):
    """Evaluate every B_k at x [n], [K, n], so that f = c @ basis."""
    columns = np.zeros((count, len(x)))
    for t in range(len(x)):
        k, beyond, values, slopes = _pieces((x[t] - low) / step, count)
        for j in range(4):
            columns[k + j, t] = values[j] + beyond * slopes[j]
    return columns
