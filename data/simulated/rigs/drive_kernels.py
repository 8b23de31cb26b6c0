"""What lies between the input of a test rig and what arrives at its plant, at a fine fixed step."""

from __future__ import annotations

from math import exp, inf
from typing import NamedTuple

import numpy as np
from numba import njit


class Drive(NamedTuple):
    """What lies between the input u and the w that arrives, in this order."""

    delay: float  # s, rounded to a step of the integration
    squared: float  # share of the input that acts by its square, as the thrust of a propeller does
    amplitude: float  # input units: where the square is as large as the input
    fade: float  # share of the gain that is lost, linearly, by the end of an experiment
    asymmetry: float  # share: positive input counts 1 + a, negative 1 - a
    dead_zone: float  # input units, each way
    limit: float  # input units, each way; infinite is off
    rate: float  # input units per s, upwards, and half of it downwards; infinite is off
    gap: float  # input units, whole gap of the backlash
    stick: float  # input units, band in which a valve sticks that turns back
    slip: float  # input units, jump with which it starts again
    lag: float  # s
    inner_limit: float  # input units, upwards, behind the lag; infinite is off


@njit(cache=True)
def sticking(drive, x, valve):
    """Follow a valve to the next command x; it is known by its stem, the last x, its side, and where it stopped.

    The side is that of the last motion, times 2 while it goes on. What stopped starts again the same way beyond the
    slip jump, and the other way beyond the stick band; it then lags behind x by half of what lies between the two.
    """
    stem, before, side, stopped = valve
    if abs(side) == 2.0 and (x - before) * side <= 0.0:
        side, stopped = side / 2.0, before
    if abs(side) != 2.0:
        onwards, back, way = drive.slip, drive.stick, side
        if side == 0.0:  # it has not moved yet, and stands in the middle of its band
            onwards = back = (drive.stick + drive.slip) / 2
            way = 1.0
        if (x - stopped) * way > onwards:
            side = 2.0 * way
        elif (stopped - x) * way > back:
            side = -2.0 * way
    if abs(side) == 2.0:
        stem = x - side / 2.0 * (drive.stick - drive.slip) / 2
    return stem, x, side, stopped


@njit(cache=True)
def arriving(drive, u, dt, substeps):
    """Compute w [T substeps, 3] at the begin, middle and end of each substep, over which only the lag moves it."""
    steps, h = len(u) * substeps, dt / substeps
    shift = round(drive.delay / h)
    w = np.empty((steps, 3))
    last, lagged, followed = 0.0, 0.0, 0.0
    valve = (0.0, 0.0, 0.0, 0.0)
    for step in range(steps):
        value = u[max((step - shift) // substeps, 0)]
        value += drive.squared * value * (abs(value) / drive.amplitude - 1.0)
        value *= 1.0 - drive.fade * (step + 0.5) / steps
        value *= 1.0 + drive.asymmetry if value > 0 else 1.0 - drive.asymmetry
        value = max(value - drive.dead_zone, 0.0) + min(value + drive.dead_zone, 0.0)
        value = min(max(value, -drive.limit), drive.limit)
        if drive.rate < inf:
            # The middle of the way that is taken within the substep.
            end = min(max(value, followed - drive.rate / 2 * h), followed + drive.rate * h) if step else value
            value = (end + (followed if step else value)) / 2
            followed = end
        last = value = min(max(last, value - drive.gap / 2), value + drive.gap / 2)
        if drive.stick > 0.0:
            if step == 0 or (step - shift) % substeps == 0:
                valve = sticking(drive, value, valve)
            value = valve[0]
        if step == 0 or drive.lag == 0.0:
            lagged = value
        keep = exp(-h / 2 / drive.lag) if drive.lag > 0.0 else 0.0
        w[step, 0] = lagged
        w[step, 1] = value + (lagged - value) * keep
        w[step, 2] = lagged = value + (lagged - value) * keep * keep
    return np.minimum(w, drive.inner_limit)
