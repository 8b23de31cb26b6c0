"""The motion of the test rigs, integrated at a fine fixed step: a body on a spring, and tanks in a row.

body:   x' = v,   v' = gain w - damping v - stiffness x + force(t, x, v, z) - friction(v)
tanks:  level' = inflow - outflow(level),   inflow = gain w, or what leaves an upper tank that takes gain w

Forces are per unit of mass. w is what arrives of the input u (`drive_kernels.py`), which stood at u[0] before the first
sample. Dry friction holds a body at a velocity of exactly 0 for as long as the other forces stay below its limit.
"""

from __future__ import annotations

from math import exp, pi, sin, sqrt
from typing import NamedTuple

import numpy as np
from numba import njit, types

from simgap.data.simulated.rigs.drive_kernels import Drive, arriving


class Body(NamedTuple):
    """The constants of a body of mass 1. L stands for the unit of length."""

    gain: float  # L/s^2 per input unit
    damping: float  # 1/s
    stiffness: float  # 1/s^2
    load: float  # L/s^2
    coulomb: float  # L/s^2
    load_share: float  # of the force that the transmission carries
    stribeck: float  # L/s^2 at high speed; at rest times `breakaway`
    breakaway: float
    stribeck_velocity: float  # L/s
    drag: float  # 1/L
    stiffness2: float  # 1/(L s^2)
    stiffness3: float  # 1/(L^2 s^2)
    gravity: float  # L/s^2, of a pendulum whose angle is in rad
    position_force: float  # L/s^2
    position_period: float  # L
    position_phase: float  # rad
    periodic: float  # L/s^2
    frequency: float  # Hz
    phase: float  # rad
    hysteresis: float  # L/s^2 at saturation
    hysteresis_width: float  # L that the body moves until then
    ripple: float  # share by which the gain changes over position
    ripple_period: float  # L
    stop: float  # L from the centre, each way; infinite is off
    coast: float  # L/s, of a cart L/s^2, how fast it can return to zero; infinite is off
    push: float  # 1/s, negative damping at the centre
    push_width: float  # L from the centre to where it turns into damping
    loop: float  # 1 where a position controller inside acts on w - x, 0 where w is the drive itself
    fold: float  # L, error of that controller beyond which its torque falls; infinite is off
    fold_lost: float  # share of the torque that is lost at twice that error


class Tanks(NamedTuple):
    """The constants of one tank, or of two where `upper` is not 0. L stands for the unit of level."""

    gain: float  # L/s per input unit
    outflow: float  # 1/s
    upper: float  # 1/s, outflow of the upper tank
    level: float  # L at the operating point
    upper_level: float  # L
    root: float  # share of the outflow that goes with the root of the level
    rim: float  # L; infinite is off
    spill: float  # share of what the upper tank spills that the lower one catches
    periodic: float  # L/s
    frequency: float  # Hz
    phase: float  # rad


def floats(kind):
    """Give the compiler's type of a named tuple of floats."""
    return types.NamedUniTuple(types.float64, len(kind._fields), kind)


ROWS, FLOAT = types.float64[::1], types.float64
# drive, u [T], other [T + 1], start 0, start 1, dt, substeps
RECORD = (floats(Drive), ROWS, ROWS, FLOAT, FLOAT, FLOAT, types.int64)


@njit(cache=True)
def friction(p, w, x, v):
    """Compute the size of the dry friction of a moving body; at v = 0 the force at which it breaks away."""
    size = p.coulomb + p.load_share * abs(p.gain * w + p.stiffness * x)
    if p.stribeck != 0.0:
        size += p.stribeck * (1.0 + (p.breakaway - 1.0) * exp(-((v / p.stribeck_velocity) ** 2)))
    return size


@njit(cache=True)
def controlled(p, e):
    """Turn the error of the controller into its command, which falls back where the error is large."""
    far = abs(e) / p.fold
    if far <= 1.0:
        return e
    return (p.fold if e > 0.0 else -p.fold) * (1.0 - p.fold_lost * min(far - 1.0, 1.0))


@njit(cache=True)
def force(p, w, other, t, x, v, z):
    """Sum all forces but dry friction; w and `other`, a force from outside, are those of the time t."""
    total = other + p.load - v * (p.damping + p.drag * abs(v)) - p.hysteresis * z
    total -= x * (p.stiffness + x * (p.stiffness2 + x * p.stiffness3))
    total += p.push * v * (1.0 - (x / p.push_width) ** 2)
    gain = p.gain
    if p.ripple != 0.0:  # sines are what costs time here
        gain *= 1.0 + p.ripple * sin(2 * pi * x / p.ripple_period)
    if p.gravity != 0.0:
        total -= p.gravity * sin(x)
    if p.position_force != 0.0:
        total -= p.position_force * sin(2 * pi * x / p.position_period + p.position_phase)
    if p.periodic != 0.0:
        total += p.periodic * sin(2 * pi * p.frequency * t + p.phase)
    if p.loop != 0.0:
        w = controlled(p, w - x)
    return total + gain * w


@njit(cache=True)
def rates(p, w, other, side, t, x, v, z):
    """Compute d/dt of (x, v, z); z in [-1, 1] is Bouc-Wen's state: z' = (v - |v| z / 2 - v |z| / 2) / width."""
    dz = (v - 0.5 * abs(v) * z - 0.5 * v * abs(z)) / p.hysteresis_width
    return v, force(p, w, other, t, x, v, z) - side * friction(p, w, x, v), dz


@njit(cache=True)
def glide(p, w, other, side, t, h, x, v, z):
    """Take a Runge-Kutta step of order 4 with the side of dry friction held; w, other: begin, middle, end."""
    x1, v1, z1 = rates(p, w[0], other[0], side, t, x, v, z)
    x2, v2, z2 = rates(p, w[1], other[1], side, t + h / 2, x + h / 2 * x1, v + h / 2 * v1, z + h / 2 * z1)
    x3, v3, z3 = rates(p, w[1], other[1], side, t + h / 2, x + h / 2 * x2, v + h / 2 * v2, z + h / 2 * z2)
    x4, v4, z4 = rates(p, w[2], other[2], side, t + h, x + h * x3, v + h * v3, z + h * z3)
    x += h / 6 * (x1 + 2 * x2 + 2 * x3 + x4)
    v += h / 6 * (v1 + 2 * v2 + 2 * v3 + v4)
    return x, v, z + h / 6 * (z1 + 2 * z2 + 2 * z3 + z4)


@njit(cache=True)
def step_body(p, w, other, t, h, x, v, z):
    """Move (x, v, z) on by h seconds, with sticking."""
    if p.coulomb == 0.0 and p.stribeck == 0.0 and p.load_share == 0.0:
        return glide(p, w, other, 0.0, t, h, x, v, z)
    rest = h
    if v != 0.0:
        side = 1.0 if v > 0 else -1.0
        x_end, v_end, z_end = glide(p, w, other, side, t, h, x, v, z)
        if v_end * side > 0:
            return x_end, v_end, z_end
        # The body stops within the step; the velocity is nearly straight over so short a time.
        used = h * v / (v - v_end)
        x, _, z = glide(p, w, other, side, t, used, x, v, z)
        rest = h - used
    net = force(p, w[1], other[1], t + h - rest / 2, x, 0.0, z)
    if abs(net) <= friction(p, w[1], x, 0.0) or rest == 0.0:
        return x, 0.0, z
    side = 1.0 if net > 0 else -1.0
    x_end, v_end, z_end = glide(p, w, other, side, t + h - rest, rest, x, 0.0, z)
    # A force that turns around within the rest of the step does not set the body in motion.
    return (x_end, v_end, z_end) if v_end * side > 0 else (x, 0.0, z)


@njit(cache=True)
def outside(other, step, substeps):
    """Interpolate what comes from outside at the begin, middle and end of a substep, from its values at the samples."""
    k, share = step // substeps, (step % substeps) / substeps
    begin = other[k] + (other[k + 1] - other[k]) * share
    half = (other[k + 1] - other[k]) / (2 * substeps)
    return begin, begin + half, begin + 2 * half


@njit(cache=True)
def stopped(p, x, v):
    """Keep the body between its stops; what runs into one loses its velocity."""
    if x > p.stop:
        return p.stop, min(v, 0.0)
    if x < -p.stop:
        return -p.stop, max(v, 0.0)
    return x, v


@njit(cache=True)
def coasting(p, h, before, rate, x, v):
    """Let a body that was at (before, rate) h seconds ago return to zero no faster than it may."""
    if p.stiffness != 0.0:  # its position
        side = 1.0 if before > 0.0 else -1.0
        if side * v < -p.coast:
            x = before + 0.5 * h * side * (max(side * rate, -p.coast) - p.coast)
            v = -side * p.coast
        return x, v
    side = 1.0 if rate > 0.0 else -1.0  # its velocity
    if side * (v - rate) >= -h * p.coast:
        return x, v
    slowing = abs(rate) / p.coast  # s, until it stands; then the drive may push it the other way
    return x, rate - side * h * p.coast if slowing > h else (v - rate) * (1.0 - slowing / h)


@njit(types.float64[:, ::1](floats(Body), *RECORD), cache=True)
def move(p, drive, u, other, x, v, dt, substeps):
    """Integrate (x, v) [T substeps, 2] under the input u [T] and a force `other` [T + 1], straight between samples."""
    h = dt / substeps
    w = arriving(drive, u, dt, substeps)
    motion = np.empty((len(u) * substeps, 2))
    z = 0.0
    x, v = stopped(p, x, v)
    for step in range(len(motion)):
        motion[step, 0], motion[step, 1] = x, v
        x, v, z = step_body(p, w[step], outside(other, step, substeps), step * h, h, x, v, z)
        x, v = coasting(p, h, motion[step, 0], motion[step, 1], x, v)
        x, v = stopped(p, x, v)
    return motion


@njit(cache=True)
def leaving(p, rate, level, reference):
    """Compute what runs out of a tank: both laws agree at the reference level."""
    level = max(level, 0.0)
    return rate * ((1.0 - p.root) * level + p.root * sqrt(level * reference))


@njit(cache=True)
def flows(p, w, other, t, lower, upper):
    """Compute d/dt of the two levels below the rim."""
    inflow = p.gain * w + other
    if p.periodic != 0.0:
        inflow += p.periodic * sin(2 * pi * p.frequency * t + p.phase)
    out = leaving(p, p.outflow, lower, p.level)
    if p.upper == 0.0:
        return inflow - out, 0.0
    passed = leaving(p, p.upper, upper, p.upper_level)
    return passed - out, inflow - passed


@njit(types.float64[:, ::1](floats(Tanks), *RECORD), cache=True)
def fill(p, drive, u, other, lower, upper, dt, substeps):
    """Integrate (lower, upper) [T substeps, 2] under the input u [T] and an inflow `other` [T + 1]."""
    h = dt / substeps
    w = arriving(drive, u, dt, substeps)
    levels = np.empty((len(u) * substeps, 2))
    lower, upper = min(lower, p.rim), min(upper, p.rim)
    for step in range(len(levels)):
        levels[step, 0], levels[step, 1] = lower, upper
        t, d = step * h, outside(other, step, substeps)
        a1, b1 = flows(p, w[step, 0], d[0], t, lower, upper)
        a2, b2 = flows(p, w[step, 1], d[1], t + h / 2, lower + h / 2 * a1, upper + h / 2 * b1)
        a3, b3 = flows(p, w[step, 1], d[1], t + h / 2, lower + h / 2 * a2, upper + h / 2 * b2)
        a4, b4 = flows(p, w[step, 2], d[2], t + h, lower + h * a3, upper + h * b3)
        upper = max(upper + h / 6 * (b1 + 2 * b2 + 2 * b3 + b4), 0.0)
        spilled = max(upper - p.rim, 0.0)
        upper -= spilled
        lower = max(lower + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4) + p.spill * spilled, 0.0)
        lower = min(lower, p.rim)
    return levels
