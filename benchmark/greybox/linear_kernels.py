"""The linear part of a grey box, compiled: from poles to states at the samples, and from these to readings."""

from __future__ import annotations

import numpy as np
from numba import njit, types

_matrix, _cube, _places = types.float64[:, ::1], types.float64[:, :, ::1], types.int64[::1]
_states = types.float64[:, :, :, ::1]


@njit(types.void(_matrix, _matrix, _matrix), cache=True, nogil=True)
def _multiply(a, b, product):
    for i in range(a.shape[0]):
        for j in range(b.shape[1]):
            product[i, j] = 0.0
            for q in range(a.shape[1]):
                product[i, j] += a[i, q] * b[q, j]


@njit(types.void(_matrix, types.float64, _matrix, _matrix, _matrix), cache=True, nogil=True)
def transition(a, h, e, g0, g1):  # noqa: PLR0912
    """Fill exp(A h), integral of exp(A s), and integral of exp(A (h - s)) s / h, over s from 0 to h.

    Taylor series with scaling and doubling: for phi_1(A h) h and phi_2(A h) h (Hochbruck and Ostermann 2010, 2.10).
    """
    n = a.shape[0]
    size = 0.0
    for i in range(n):
        for j in range(n):
            size += abs(a[i, j])
    halvings = 0
    while size * h > 0.5:
        h *= 0.5
        halvings += 1
    power, product = np.zeros((n, n)), np.zeros((n, n))
    for i in range(n):
        for j in range(n):
            power[i, j] = e[i, j] = 1.0 if i == j else 0.0
            g0[i, j], g1[i, j] = h * power[i, j], 0.5 * h * power[i, j]
    factor = 1.0
    for k in range(1, 13):
        _multiply(power, a, product)
        factor *= k
        for i in range(n):
            for j in range(n):
                power[i, j] = h * product[i, j]
                e[i, j] += power[i, j] / factor
                g0[i, j] += h * power[i, j] / (factor * (k + 1))
                g1[i, j] += h * power[i, j] / (factor * (k + 1) * (k + 2))
    for _ in range(halvings):
        # Over two steps: e e; the constant enters twice; the ramp is half a ramp, then half a ramp on a half.
        _multiply(e, g1, product)
        for i in range(n):
            for j in range(n):
                g1[i, j] = 0.5 * (product[i, j] + g1[i, j] + g0[i, j])
        _multiply(e, g0, product)
        for i in range(n):
            for j in range(n):
                g0[i, j] += product[i, j]
        _multiply(e, e, product)
        for i in range(n):
            for j in range(n):
                e[i, j] = product[i, j]


@njit(types.void(_cube, types.float64, _cube, _cube, _cube), cache=True, nogil=True)
def transitions(a, h, e, g0, g1):
    """Fill the transitions of S matrices a [S, n, n]."""
    for s in range(len(a)):
        transition(a[s], h, e[s], g0[s], g1[s])


@njit(types.void(types.float64[::1], _matrix), cache=True, nogil=True)
def companion(sections, a):
    """Fill A of z = (x, x', ..), from the coefficients of sections s^2 + a1 s + a0 and, last, s + a."""
    n = len(sections)
    polynomial, product = np.zeros(n + 1), np.zeros(n + 1)  # the highest power first
    polynomial[0] = 1.0
    for first in range(0, n, 2):
        width = min(2, n - first)
        for i in range(n + 1):
            product[i] = polynomial[i]
            for q in range(min(width, i)):
                product[i] += polynomial[i - 1 - q] * sections[first + q]
        for i in range(n + 1):
            polynomial[i] = product[i]
    for i in range(n):
        for j in range(n):
            a[i, j] = 1.0 if j == i + 1 else 0.0
    for j in range(n):
        a[n - 1, j] = -polynomial[n - j]


@njit(types.void(_cube, _cube, types.int64, _cube, _cube, types.int64, _states), cache=True, nogil=True)
def run_linear(es, g0s, entry, drive, start, substeps, states):
    """Fill states [S, E, T, n] of S linear plants without forces, as `kernels.run_body` does with them."""
    runs, experiments, samples, n = states.shape
    z, new = np.empty((runs, n)), np.empty(n)
    for experiment in range(experiments):
        for s in range(runs):
            for i in range(n):
                z[s, i] = start[s, experiment, i]
        step = 0
        for k in range(samples):
            for s in range(runs):
                for i in range(n):
                    states[s, experiment, k, i] = z[s, i]
            if k == samples - 1:
                break
            for _ in range(substeps):
                for s in range(runs):
                    u, e, g0 = drive[s, experiment, step], es[s], g0s[s]
                    for i in range(n):
                        total = g0[i, entry] * u
                        for j in range(n):
                            total += e[i, j] * z[s, j]
                        new[i] = total
                    for i in range(n):
                        z[s, i] = new[i]
                step += 1


@njit(types.void(_states, _states, _places, _cube, _states), cache=True, nogil=True)
def read(known, states, which, readings, y):
    """Fill outputs y [S, E, T, ny] = C z, C being the readings; z are the states numbered `which` [S], -1 the known."""
    _, experiments, samples, outputs = y.shape
    for s in range(len(y)):
        of_run = states[which[s]] if which[s] >= 0 else known[0]
        for j in range(outputs):
            for experiment in range(experiments):
                for k in range(samples):
                    y[s, experiment, k, j] = 0.0
            for i in range(of_run.shape[2]):
                c = readings[s, j, i]
                if c != 0.0:  # what no sensor sees may grow without bound
                    for experiment in range(experiments):
                        for k in range(samples):
                            y[s, experiment, k, j] += c * of_run[experiment, k, i]
