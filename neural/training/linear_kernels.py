"""The passes of linear recurrences through time, compiled; arrays are [B, T, features], and channels run side by side.

All start from the state zero. A backward kernel is the adjoint: the same recurrence over the reversed gradient.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, fastmath=True, error_model="numpy")
def run_diagonal(v, re, im, s):
    """Compute s(k) = lambda s(k-1) + v(k), complex: of 2N features, the real parts of N come first."""
    batch, steps, both = v.shape
    n = both // 2
    p, q = np.empty(n, v.dtype), np.empty(n, v.dtype)
    for b in range(batch):
        p[:], q[:] = 0, 0
        for t in range(steps):
            for i in range(n):
                real = re[i] * p[i] - im[i] * q[i] + v[b, t, i]
                q[i] = re[i] * q[i] + im[i] * p[i] + v[b, t, n + i]
                p[i] = real
            for i in range(n):
                s[b, t, i], s[b, t, n + i] = p[i], q[i]


@njit(cache=True, fastmath=True, error_model="numpy")
def back_diagonal(re, im, s, ds, dv, d_re, d_im):
    """Run `run_diagonal` backwards: dv(k) = ds(k) + conj(lambda) dv(k+1), d lambda = sum of dv(k) conj(s(k-1))."""
    batch, steps, both = s.shape
    n = both // 2
    p, q = np.empty(n, s.dtype), np.empty(n, s.dtype)
    d_re[:], d_im[:] = 0, 0
    for b in range(batch):
        p[:], q[:] = 0, 0
        for t in range(steps - 1, -1, -1):
            for i in range(n):
                real = re[i] * p[i] + im[i] * q[i] + ds[b, t, i]
                q[i] = re[i] * q[i] - im[i] * p[i] + ds[b, t, n + i]
                p[i] = real
            for i in range(n):
                dv[b, t, i], dv[b, t, n + i] = p[i], q[i]
            if t > 0:
                for i in range(n):
                    d_re[i] += p[i] * s[b, t - 1, i] + q[i] * s[b, t - 1, n + i]
                for i in range(n):
                    d_im[i] += q[i] * s[b, t - 1, i] - p[i] * s[b, t - 1, n + i]


@njit(cache=True, fastmath=True, error_model="numpy")
def run_section(x, num, den, y):
    """Compute y(k) = b0 x(k) + b1 x(k-1) + b2 x(k-2) - a1 y(k-1) - a2 y(k-2); num [3, C], den [2, C]."""
    batch, steps, n = x.shape
    one, two = np.empty(n, x.dtype), np.empty(n, x.dtype)  # the transposed direct form: two states
    for b in range(batch):
        one[:], two[:] = 0, 0
        for t in range(steps):
            for i in range(n):
                now = x[b, t, i]
                out = num[0, i] * now + one[i]
                one[i] = num[1, i] * now - den[0, i] * out + two[i]
                two[i] = num[2, i] * now - den[1, i] * out
                y[b, t, i] = out


@njit(cache=True, fastmath=True, error_model="numpy")
def back_section(x, num, den, y, dy, dx, d_num, d_den):
    """Run `run_section` backwards: w = dy filtered by 1/A in reversed time, and dx = w filtered by B.

    d b_j = sum of w(k) x(k-j), d a_i = - sum of w(k) y(k-i) (Forgione and Piga 2021).
    """
    batch, steps, n = x.shape
    one, two = np.empty(n, x.dtype), np.empty(n, x.dtype)
    d_num[:], d_den[:] = 0, 0
    for b in range(batch):
        one[:], two[:] = 0, 0  # w(k+1) and w(k+2)
        for t in range(steps - 1, -1, -1):
            for i in range(n):
                w = dy[b, t, i] - den[0, i] * one[i] - den[1, i] * two[i]
                dx[b, t, i] = num[0, i] * w + num[1, i] * one[i] + num[2, i] * two[i]
                two[i] = one[i]
                one[i] = w
            for j in range(min(3, t + 1)):
                for i in range(n):
                    d_num[j, i] += one[i] * x[b, t - j, i]
            for j in range(min(2, t)):
                for i in range(n):
                    d_den[j, i] -= one[i] * y[b, t - 1 - j, i]
