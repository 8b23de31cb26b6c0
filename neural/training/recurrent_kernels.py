"""The passes of recurrent layers through time, compiled; arrays are [T, features, B].

A backward kernel leaves the gradient before the activations in `d` [G H, T, B]; one product of it gives those of
all weights.
"""

from __future__ import annotations

import numpy as np
from numba import njit

ZERO, HALF, ONE = np.float32(0), np.float32(0.5), np.float32(1)


@njit(cache=True, fastmath=True, error_model="numpy", inline="always")
def tanh(x):
    """Compute tanh to 3e-7 by the rational function that Eigen uses (generic_fast_tanh_float); it runs in SIMD."""
    x = min(max(x, np.float32(-7.90531110763549805)), np.float32(7.90531110763549805))
    s = x * x
    p = np.float32(-2.76076847742355e-16) * s + np.float32(2.00018790482477e-13)
    p = p * s + np.float32(-8.60467152213735e-11)
    p = p * s + np.float32(5.12229709037114e-08)
    p = p * s + np.float32(1.48572235717979e-05)
    p = p * s + np.float32(6.37261928875436e-04)
    p = p * s + np.float32(4.89352455891786e-03)
    q = np.float32(1.19825839466702e-06) * s + np.float32(1.18534705686654e-04)
    q = q * s + np.float32(2.26843463243900e-03)
    q = q * s + np.float32(4.89352518554385e-03)
    return x * p / q


@njit(cache=True, fastmath=True, error_model="numpy", inline="always")
def sigmoid(x):
    """Compute 1 / (1 + exp(-x))."""
    return HALF + HALF * tanh(HALF * x)


@njit(cache=True, fastmath=True, error_model="numpy")
def run_rnn(x, w, u, offset, h):
    """Compute h(k) = tanh(W x(k) + U h(k-1) + offset)."""
    steps, units, batch = h.shape
    a, b = np.empty((units, batch), u.dtype), np.zeros((units, batch), u.dtype)
    for t in range(steps):
        np.dot(w, x[t], a)
        if t > 0:
            np.dot(u, h[t - 1], b)
        for i in range(units):
            for k in range(batch):
                h[t, i, k] = tanh(a[i, k] + b[i, k] + offset[i])


@njit(cache=True, fastmath=True, error_model="numpy")
def back_rnn(ut, h, dh, only_last, d):
    """Run `run_rnn` backwards; ut is U', dh the gradient of h."""
    steps, units, batch = h.shape
    e, now = np.zeros((units, batch), ut.dtype), np.empty((units, batch), ut.dtype)
    for t in range(steps - 1, -1, -1):
        has_gradient = t == steps - 1 or not only_last
        for i in range(units):
            for k in range(batch):
                g = e[i, k] + (dh[t, i, k] if has_gradient else ZERO)
                g *= ONE - h[t, i, k] * h[t, i, k]
                now[i, k] = g
                d[i, t, k] = g
        np.dot(ut, now, e)


@njit(cache=True, fastmath=True, error_model="numpy")
def run_gru(x, w, u, offset, inner_offset, h, gates, inner):
    """Compute n = tanh(W x + b + r (U h + c)) and h(k) = (1 - z) n + z h(k-1) with gates r, z, n as in PyTorch."""
    steps, units, batch = h.shape
    a, b = np.empty((3 * units, batch), u.dtype), np.zeros((3 * units, batch), u.dtype)
    zero = np.zeros((units, batch), u.dtype)
    for t in range(steps):
        before = h[t - 1] if t > 0 else zero
        np.dot(w, x[t], a)
        np.dot(u, before, b)
        for i in range(2 * units):
            bias = offset[i] + inner_offset[i]
            for k in range(batch):
                gates[t, i, k] = sigmoid(a[i, k] + b[i, k] + bias)
        for i in range(units):
            j = 2 * units + i
            for k in range(batch):
                m = b[j, k] + inner_offset[j]
                n = tanh(a[j, k] + offset[j] + gates[t, i, k] * m)
                inner[t, i, k] = m
                gates[t, j, k] = n
                h[t, i, k] = n + gates[t, units + i, k] * (before[i, k] - n)


@njit(cache=True, fastmath=True, error_model="numpy")
def back_gru(ut, h, gates, inner, dh, only_last, d, d_inner):
    """Run `run_gru` backwards; d_inner is the gradient of what r multiplies."""
    steps, units, batch = h.shape
    e, now = np.zeros((units, batch), ut.dtype), np.empty((3 * units, batch), ut.dtype)
    keep, zero = np.empty((units, batch), ut.dtype), np.zeros((units, batch), ut.dtype)
    for t in range(steps - 1, -1, -1):
        has_gradient = t == steps - 1 or not only_last
        before = h[t - 1] if t > 0 else zero
        for i in range(units):
            for k in range(batch):
                g = e[i, k] + (dh[t, i, k] if has_gradient else ZERO)
                r, z, n = gates[t, i, k], gates[t, units + i, k], gates[t, 2 * units + i, k]
                dn = g * (ONE - z) * (ONE - n * n)
                dr = dn * inner[t, i, k] * r * (ONE - r)
                dz = g * (before[i, k] - n) * z * (ONE - z)
                dm = dn * r
                now[i, k], now[units + i, k], now[2 * units + i, k] = dr, dz, dm
                d[i, t, k], d[units + i, t, k], d[2 * units + i, t, k] = dr, dz, dn
                d_inner[i, t, k] = dm
                keep[i, k] = g * z
        np.dot(ut, now, e)
        for i in range(units):
            for k in range(batch):
                e[i, k] += keep[i, k]


@njit(cache=True, fastmath=True, error_model="numpy")
def run_lstm(x, w, u, offset, h, gates, cells):
    """i, f, o = sigma(.); g = tanh(.); c(k) = f c(k-1) + i g; h(k) = o tanh(c(k)). Gates i, f, g, o as in PyTorch."""
    steps, units, batch = h.shape
    a, b = np.empty((4 * units, batch), u.dtype), np.zeros((4 * units, batch), u.dtype)
    zero = np.zeros((units, batch), u.dtype)
    for t in range(steps):
        before = cells[t - 1] if t > 0 else zero
        np.dot(w, x[t], a)
        if t > 0:
            np.dot(u, h[t - 1], b)
        for j in range(units):
            for k in range(batch):
                i = sigmoid(a[j, k] + b[j, k] + offset[j])
                f = sigmoid(a[units + j, k] + b[units + j, k] + offset[units + j])
                g = tanh(a[2 * units + j, k] + b[2 * units + j, k] + offset[2 * units + j])
                o = sigmoid(a[3 * units + j, k] + b[3 * units + j, k] + offset[3 * units + j])
                c = f * before[j, k] + i * g
                gates[t, j, k], gates[t, units + j, k] = i, f
                gates[t, 2 * units + j, k], gates[t, 3 * units + j, k] = g, o
                cells[t, j, k] = c
                h[t, j, k] = o * tanh(c)


@njit(cache=True, fastmath=True, error_model="numpy")
def back_lstm(ut, gates, cells, dh, only_last, d):
    """Run `run_lstm` backwards."""
    steps, units, batch = cells.shape
    e, now = np.zeros((units, batch), ut.dtype), np.empty((4 * units, batch), ut.dtype)
    dc, zero = np.zeros((units, batch), ut.dtype), np.zeros((units, batch), ut.dtype)
    for t in range(steps - 1, -1, -1):
        has_gradient = t == steps - 1 or not only_last
        before = cells[t - 1] if t > 0 else zero
        for j in range(units):
            for k in range(batch):
                grad = e[j, k] + (dh[t, j, k] if has_gradient else ZERO)
                i, f = gates[t, j, k], gates[t, units + j, k]
                g, o = gates[t, 2 * units + j, k], gates[t, 3 * units + j, k]
                bent = tanh(cells[t, j, k])
                c = dc[j, k] + grad * o * (ONE - bent * bent)
                di = c * g * i * (ONE - i)
                df = c * before[j, k] * f * (ONE - f)
                dg = c * i * (ONE - g * g)
                do = grad * bent * o * (ONE - o)
                dc[j, k] = c * f
                now[j, k], now[units + j, k], now[2 * units + j, k], now[3 * units + j, k] = di, df, dg, do
                d[j, t, k], d[units + j, t, k] = di, df
                d[2 * units + j, t, k], d[3 * units + j, t, k] = dg, do
        np.dot(ut, now, e)
