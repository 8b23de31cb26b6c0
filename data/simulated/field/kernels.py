"""The motion of the machines in the field, with their controllers, integrated at a fine fixed step.

body:     q1'' = gain w + load + d(t) - damping q1' - k q1 - k3 q1^3 - gravity sin(q1) - joint - friction
          q2'' = ratio joint - link_damping q2',   joint = spring (q1 - q2) + loss (q1' - q2')
process:  lag q1' = gain w + d(t) - q1,   second q2' = q1 - q2

w is what arrives of the inputs u; the first of them may come from a controller that reads the noisy output.
"""

from __future__ import annotations

from math import sin
from typing import NamedTuple

import numpy as np
from numba import njit

from simgap.data.simulated.rigs.drive_kernels import sticking

HELD = 2.0  # instead of a side of dry friction


class Machine(NamedTuple):
    """The constants of a body of mass 1, or of a process of one or two lags."""

    process: bool = False
    measured: int = 0  # of the states q1, q1', q2, q2'
    gain: float = 1.0
    gain2: float = 0.0  # of the second input
    damping: float = 0.0
    stiffness: float = 0.0
    stiffness3: float = 0.0
    gravity: float = 0.0
    spring: float = 0.0
    loss: float = 0.0
    ratio: float = 1.0  # motor's inertia over the link's
    link_damping: float = 0.0
    load: float = 0.0
    coulomb: float = 0.0
    lag: float = 1.0
    second: float = 0.0


class Controller(NamedTuple):
    """u = bias + kp (r - y) + ki integral(r - y) - kd q1', the integral's part held within `most`; or u = r."""

    closed: bool = False
    kp: float = 0.0
    ki: float = 0.0
    kd: float = 0.0
    bias: float = 0.0
    most: float = 0.0


class Actuator(NamedTuple):
    """What lies between one of the inputs and the machine, in this order."""

    channel: int = 0
    delay: float = 0.0  # s, rounded to a step of the integration
    dead_zone: float = 0.0  # each way
    limit: float = np.inf  # each way
    gap: float = 0.0  # whole gap of the backlash
    stick: float = 0.0  # band in which a valve sticks that turns back
    slip: float = 0.0  # jump with which it starts again


class Drive(NamedTuple):
    """What the law of the sticking valve reads."""

    stick: float
    slip: float


@njit(cache=True)
def rates(m, w, side, q, v, p, s):
    """Compute d/dt of (q1, q1', q2, q2') at q, v, p, s under the force or flow w; side 2 holds q1 where it is."""
    if m.process:
        return (w - q) / m.lag, 0.0, ((q - p) / m.second if m.second > 0.0 else 0.0), 0.0
    joint = m.spring * (q - p) + m.loss * (v - s)
    if side == HELD:
        return 0.0, 0.0, s, m.ratio * joint - m.link_damping * s
    a = w + m.load - m.damping * v - q * (m.stiffness + m.stiffness3 * q * q) - joint - side * m.coulomb
    if m.gravity != 0.0:
        a -= m.gravity * sin(q)
    return v, a, s, m.ratio * joint - m.link_damping * s


@njit(cache=True)
def glide(m, w, side, h, z):
    """Take a Runge-Kutta step of order 4 with the side of dry friction held."""
    a = rates(m, w, side, z[0], z[1], z[2], z[3])
    b = rates(m, w, side, z[0] + h / 2 * a[0], z[1] + h / 2 * a[1], z[2] + h / 2 * a[2], z[3] + h / 2 * a[3])
    c = rates(m, w, side, z[0] + h / 2 * b[0], z[1] + h / 2 * b[1], z[2] + h / 2 * b[2], z[3] + h / 2 * b[3])
    d = rates(m, w, side, z[0] + h * c[0], z[1] + h * c[1], z[2] + h * c[2], z[3] + h * c[3])
    return (
        z[0] + h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0]), z[1] + h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1]),
        z[2] + h / 6 * (a[2] + 2 * b[2] + 2 * c[2] + d[2]), z[3] + h / 6 * (a[3] + 2 * b[3] + 2 * c[3] + d[3]),
    )  # fmt: skip


@njit(cache=True)
def step_machine(m, w, h, z):
    """Move the states on by h seconds; dry friction holds q1' at exactly 0 while the other forces stay below it."""
    if m.coulomb == 0.0 or m.process:
        return glide(m, w, 0.0, h, z)
    rest = h
    if z[1] != 0.0:
        side = 1.0 if z[1] > 0 else -1.0
        end = glide(m, w, side, h, z)
        if end[1] * side > 0:
            return end
        # It stops within the step; the velocity is nearly straight over so short a time.
        used = h * z[1] / (z[1] - end[1])
        z = glide(m, w, side, used, z)
        rest = h - used
    z = (z[0], 0.0, z[2], z[3])
    net = rates(m, w, 0.0, *z)[1]
    side = 1.0 if net > 0 else -1.0
    if abs(net) > m.coulomb:
        end = glide(m, w, side, rest, z)
        if end[1] * side > 0:
            return end
    return glide(m, w, HELD, rest, z)  # a link swings on while the motor sticks


@njit(cache=True)
def actuated(a, value, last, valve, command):
    """Pass one input through the actuator, the delay apart: what arrives, and the play's and the valve's memory."""
    value = max(value - a.dead_zone, 0.0) + min(value + a.dead_zone, 0.0)
    value = min(max(value, -a.limit), a.limit)
    last = value = min(max(last, value - a.gap / 2), value + a.gap / 2)
    if a.stick > 0.0:
        if command:
            valve = sticking(Drive(a.stick, a.slip), value, valve)
        value = valve[0]
    return value, last, valve


@njit(cache=True)
def run(m, c, a, r, noise, disturbance, start, dt, substeps):
    """Record inputs u [T, nu] and the true output [T], from set points or inputs r [T, nu] and a disturbance [T + 1].

    The controller reads output plus noise [T], and sets the first input in the same sample.
    """
    samples, h = len(r), dt / substeps
    u, y = r.copy(), np.empty(samples)
    shift = round(a.delay / h)
    z, integral = (start[0], start[1], start[2], start[3]), 0.0
    last, valve = 0.0, (0.0, 0.0, 0.0, 0.0)
    for k in range(samples):
        y[k] = z[m.measured]
        if c.closed:
            error = r[k, 0] - y[k] - noise[k]
            integral = min(max(integral + c.ki * error * dt, -c.most), c.most)
            u[k, 0] = c.bias + c.kp * error + integral - c.kd * z[1]
        if k == 0:
            last = u[0, a.channel]
            valve = (last, last, 0.0, last)
        for i in range(substeps):
            step = k * substeps + i
            at = max((step - shift) // substeps, 0)
            new = step == 0 or (step - shift) % substeps == 0
            acted, last, valve = actuated(a, u[at, a.channel], last, valve, new)
            w = 0.0
            for channel in range(u.shape[1]):
                gain = m.gain if channel == 0 else m.gain2
                w += gain * (acted if channel == a.channel else u[k, channel])
            share = i / substeps
            w += disturbance[k] + (disturbance[k + 1] - disturbance[k]) * share
            z = step_machine(m, w, h, z)
    return u, y
