"""The pass of a neural state space through time, compiled; arrays are [T, features, B]."""

from __future__ import annotations

import numpy as np
from numba import njit

from simgap.neural.training.recurrent_kernels import tanh


@njit(cache=True, fastmath=True, error_model="numpy")
def run_states(a, w, v, linear, bent, s, h):
    """Compute s(k+1) = A s(k) + linear(k) + V h(k), h(k) = tanh(W s(k) + bent(k)), from s(0)."""
    steps, hidden, batch = h.shape
    states = len(a)
    one, two, inner = np.empty((states, batch), a.dtype), np.empty((states, batch), a.dtype), np.empty_like(h[0])
    for t in range(steps):
        np.dot(w, s[t], inner)
        for i in range(hidden):
            for k in range(batch):
                h[t, i, k] = tanh(inner[i, k] + bent[t, i, k])
        np.dot(a, s[t], one)
        np.dot(v, h[t], two)
        for i in range(states):
            for k in range(batch):
                s[t + 1, i, k] = one[i, k] + two[i, k] + linear[t, i, k]


@njit(cache=True, fastmath=True, error_model="numpy")
def back_states(at, wt, vt, h, ds, d_linear, d_bent):
    """Run `run_states` backwards with A', W' and V'; afterwards ds[0] is the gradient of s(0)."""
    steps, hidden, batch = h.shape
    states = len(at)
    one, two, inner = np.empty((states, batch), at.dtype), np.empty((states, batch), at.dtype), np.empty_like(h[0])
    for t in range(steps - 1, -1, -1):
        d_linear[t] = ds[t + 1]
        np.dot(vt, d_linear[t], inner)
        for i in range(hidden):
            for k in range(batch):
                d_bent[t, i, k] = inner[i, k] * (1 - h[t, i, k] * h[t, i, k])
        np.dot(at, d_linear[t], one)
        np.dot(wt, d_bent[t], two)
        for i in range(states):
            for k in range(batch):
                ds[t, i, k] += one[i, k] + two[i, k]
