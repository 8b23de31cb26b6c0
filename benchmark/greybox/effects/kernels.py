"""Effects whose state runs on from sample to sample, compiled."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

# Where a command just reaches or just misses a slip, within this share of the jump, a part of the jump is shown for one
# sample, as if the command had moved steadily there: then the simulation changes steadily with both numbers of a
# sticking valve, and a fit finds them.
SOFT = 0.3


@njit(cache=True, nogil=True)
def behind_gap(u, gap, begun):
    """Compute what follows u [E, K] behind a gap, from `begun` [E] on: the play operator."""
    position = np.empty_like(u)
    for e in range(len(u)):
        at = begun[e]
        for k in range(u.shape[1]):
            at = min(max(at, u[e, k] - 0.5 * gap), u[e, k] + 0.5 * gap)
            position[e, k] = at
    return position


@njit(cache=True, nogil=True)
def stem(u, low, high, every, begun, before):
    """Compute the position [E, K] of a stem that sticks up to a distance `high` from u and moves `low` behind it.

    It stands at `begun` [E] and the last command was `before` [E].
    """
    position = np.empty_like(u)
    for e in range(len(u)):
        at, moving, last = begun[e], 0.0, before[e]
        for k in range(0, u.shape[1], every):
            change, away = u[e, k] - last, u[e, k] - at
            last = u[e, k]
            if change * moving > 0.0:
                shown = at = last - math.copysign(low, moving)
            else:
                near = max(min(abs(change), SOFT * (high - low)), 1e-300)
                share = min(max(0.5 + (abs(away) - high) / near, 0.0), 1.0)
                side = math.copysign(1.0, away)
                shown = at + share * (away - side * low)
                moving = side if share >= 0.5 else 0.0
                if share >= 0.5:
                    at = last - side * low
            position[e, k : k + every] = shown
    return position


@njit(cache=True, nogil=True)
def limited_rate(u, up, down):
    """Compute the mean over each step of what follows u [E, K] by no more than `up` and `down` per step."""
    mean = np.empty_like(u)
    for e in range(len(u)):
        at = u[e, 0]
        for k in range(u.shape[1]):
            way = u[e, k] - at
            speed = up if way > 0.0 else down
            if abs(way) > speed:
                moved = math.copysign(speed, way)
                mean[e, k] = at + 0.5 * moved
                at += moved
            else:
                # It arrives after the share |way| / speed of the step; so much of it is half a way short.
                mean[e, k] = u[e, k] - (0.5 * way * abs(way) / speed if speed > 0.0 else 0.0)
                at = u[e, k]
    return mean


@njit(cache=True, nogil=True)
def second_order(u, time_constant, damping, h):
    """Compute the mean over each step of h seconds of what u [E, K] is behind a filter of second order, settled first.

    T^2 x'' + 2 D T x' + x = u, solved exactly for u constant over a step; integrated over it, x less u is
    -(T^2 x' + 2 D T x), of which only the change counts.
    """
    e11, e12, e21, e22 = swing(time_constant, damping, h)
    mean = np.empty_like(u)
    for e in range(len(u)):
        x, v = u[e, 0], 0.0
        for k in range(u.shape[1]):
            away = x - u[e, k]
            later, faster = u[e, k] + e11 * away + e12 * v, e21 * away + e22 * v
            change = time_constant * (time_constant * (faster - v) + 2.0 * damping * (later - x))
            mean[e, k] = u[e, k] - change / h
            x, v = later, faster
    return mean


@njit(cache=True, nogil=True)
def swing(time_constant, damping, h):
    """Return exp(A h), row by row, of T^2 x'' + 2 D T x' + x = 0 with the states x and x'."""
    decay, square = damping * h / time_constant, (damping * damping - 1.0) * (h / time_constant) ** 2
    if square > 1e-12:
        root = math.sqrt(square)
        fast, slow = math.exp(-decay - root), math.exp(root - decay)
        c, s = 0.5 * (slow + fast), 0.5 * (slow - fast) / root
    elif square < -1e-12:
        root = math.sqrt(-square)
        c, s = math.exp(-decay) * math.cos(root), math.exp(-decay) * math.sin(root) / root
    else:
        c, s = math.exp(-decay), math.exp(-decay)
    return c + decay * s, h * s, -s * h / (time_constant * time_constant), c - decay * s
