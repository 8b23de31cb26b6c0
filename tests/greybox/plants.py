"""Plants and noise whose truth is known, from the exact solution of their equations; nothing of simgap is used."""

from typing import NamedTuple

import numpy as np
from scipy.linalg import expm
from scipy.signal import lfilter


class Plant(NamedTuple):
    """x' = a x + b (u + load), y = c x."""

    a: np.ndarray  # [n, n], 1/s
    b: np.ndarray  # [n, 1]
    c: np.ndarray  # [ny, n]


def velocity(rate=1.5, gain=2.0):
    """v' = -rate v + gain u."""
    return Plant(np.array([[-rate]]), np.array([[gain]]), np.eye(1))


def position(stiffness=4.0, damping=1.2, gain=3.0, ny=1):
    """x'' = -damping x' - stiffness x + gain u; of ny = 2 the velocity is measured too."""
    return Plant(np.array([[0.0, 1.0], [-stiffness, -damping]]), np.array([[0.0], [gain]]), np.eye(2)[:ny])


def tanks(upper=0.5, lower=0.3, gain=0.4):
    """Two tanks, the upper one empties into the lower one, whose level is measured."""
    return Plant(np.array([[-upper, 0.0], [upper, -lower]]), np.array([[gain], [0.0]]), np.array([[0.0, 1.0]]))


def third_order(rates=(1.0, 3.0, 6.0), gain=20.0):
    """Three real poles, no zero."""
    *_, c2, c1, c0 = np.poly(-np.array(rates))
    return Plant(np.array([[0, 1.0, 0], [0, 0, 1.0], [-c0, -c1, -c2]]), np.array([[0], [0], [gain]]), np.eye(3)[:1])


def steps(rng, shape, hold=6, low=-1.0, high=1.0):
    """Inputs [E, T] that keep each random value for `hold` samples."""
    records, samples = shape
    return np.repeat(rng.uniform(low, high, (records, -(-samples // hold))), hold, axis=1)[:, :samples]


def free_run(plant, u, dt, start=None, smooth=False):
    """Exact outputs [E, T, ny] and states [E, T, n] for inputs u [E, T] that are held from sample to sample.

    With `smooth` the input runs on a straight line to the next sample instead: of (x, u, slope) the matrix exponential
    gives both cases.
    """
    n = len(plant.a)
    whole = np.zeros((n + 2, n + 2))
    whole[:n, :n], whole[:n, n : n + 1], whole[n, n + 1] = plant.a, plant.b, 1.0
    step = expm(whole * dt)[:n]  # [n, n + 2]
    states = np.zeros((*u.shape, n))  # [E, T, n]
    states[:, 0] = 0.0 if start is None else start
    slope = np.diff(u, axis=1) / dt if smooth else np.zeros((len(u), u.shape[1] - 1))
    for k in range(u.shape[1] - 1):
        states[:, k + 1] = np.column_stack((states[:, k], u[:, k], slope[:, k])) @ step.T
    return states @ plant.c.T, states


def coloured(rng, shape, coefficients=(), deviation=1.0):
    """Noise [E, T] with e_k = sum of coefficients times past e + w_k, settled, and its innovations w [E, T]."""
    w = deviation * rng.standard_normal((shape[0], shape[1] + 200))
    e = lfilter([1.0], [1.0, *-np.array(coefficients)], w, axis=1)
    return e[:, 200:], w[:, 200:]
