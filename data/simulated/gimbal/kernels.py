"""The gimbal's equation of motion, integrated at a fine fixed step with true sticking.

inertia phi'' = gain volts(t) - damping phi' - stiffness(phi) - loads(t, phi, phi', z) - friction(phi')

Angles are in rad, torques in N m. Between two reversals dry friction is smooth, so a Runge-Kutta step of
order 4 carries the motion; a step in which the velocity reverses is cut at the reversal, where the body
either stays (the other torques do not exceed the breakaway torque) or leaves in the net torque's direction.

Reference: Karnopp, "Computer simulation of stick-slip friction in mechanical dynamic systems", ASME J. Dyn.
Syst. Meas. Control 107 (1985) 100-103. Where he takes a band of velocities for rest, the reversal is located.
"""

from __future__ import annotations

from math import exp, pi, sin
from typing import NamedTuple

import numpy as np
from numba import njit


class Plant(NamedTuple):
    """The constants of the motion, seen at the yaw axis."""

    inertia: float  # kg m^2
    gain: float  # N m/V
    damping: float  # N m s/rad, viscous and back-EMF together
    coulomb: float  # N m
    stribeck: float  # N m on top of coulomb at standstill
    stribeck_velocity: float  # rad/s
    drag: float  # N m s^2/rad^2
    stiffness: float  # N m/rad
    stiffness2: float  # N m/rad^2
    stiffness3: float  # N m/rad^3
    position_torque: float  # N m
    position_frequency: float  # periods per rad
    position_phase: float  # rad
    load: float  # N m
    periodic: float  # N m
    periodic_frequency: float  # Hz
    hysteresis: float  # N m
    hysteresis_width: float  # rad


class Drive(NamedTuple):
    """The voltage within one step: from `start` at time t0 towards `target`, times a gain that fades."""

    target: float  # V
    start: float  # V
    t0: float  # s
    rate: float  # 1/s, the inverse of the lag; any value will do where start == target
    fade: float  # 1/s


@njit(cache=True)
def volts(drive, t):
    voltage = drive.target
    if drive.start != drive.target:
        voltage += (drive.start - drive.target) * exp(-drive.rate * (t - drive.t0))
    return (1.0 - drive.fade * t) * voltage


@njit(cache=True)
def net_torque(plant, drive, t, phi, v, z):
    """Sum all torques but dry friction. N m."""
    torque = plant.gain * volts(drive, t) - plant.damping * v - plant.load - plant.drag * v * abs(v)
    torque -= phi * (plant.stiffness + phi * (plant.stiffness2 + phi * plant.stiffness3))
    torque -= plant.hysteresis * z
    if plant.position_torque != 0.0:
        torque -= plant.position_torque * sin(2 * pi * plant.position_frequency * phi + plant.position_phase)
    if plant.periodic != 0.0:
        torque += plant.periodic * sin(2 * pi * plant.periodic_frequency * t)
    return torque


@njit(cache=True)
def dry_friction(plant, v):
    """Compute the size of the friction torque of a moving body; at v = 0 the breakaway torque. N m."""
    friction = plant.coulomb
    if plant.stribeck != 0.0:
        friction += plant.stribeck * exp(-((v / plant.stribeck_velocity) ** 2))
    return friction


@njit(cache=True)
def rates(plant, drive, direction, t, phi, v, z):
    """Compute d/dt of (phi, v, z). z in [-1, 1] is Bouc-Wen's state: z' = (v - |v| z / 2 - v |z| / 2) / width."""
    torque = net_torque(plant, drive, t, phi, v, z) - direction * dry_friction(plant, v)
    dz = 0.0
    if plant.hysteresis != 0.0:
        dz = (v - 0.5 * abs(v) * z - 0.5 * v * abs(z)) / plant.hysteresis_width
    return v, torque / plant.inertia, dz


@njit(cache=True)
def slide(plant, drive, direction, t, h, phi, v, z):
    """Take a Runge-Kutta step of order 4 over h seconds with the direction of friction held."""
    p1, v1, z1 = rates(plant, drive, direction, t, phi, v, z)
    p2, v2, z2 = rates(plant, drive, direction, t + h / 2, phi + h / 2 * p1, v + h / 2 * v1, z + h / 2 * z1)
    p3, v3, z3 = rates(plant, drive, direction, t + h / 2, phi + h / 2 * p2, v + h / 2 * v2, z + h / 2 * z2)
    p4, v4, z4 = rates(plant, drive, direction, t + h, phi + h * p3, v + h * v3, z + h * z3)
    return (
        phi + h / 6 * (p1 + 2 * p2 + 2 * p3 + p4),
        v + h / 6 * (v1 + 2 * v2 + 2 * v3 + v4),
        z + h / 6 * (z1 + 2 * z2 + 2 * z3 + z4),
    )


@njit(cache=True)
def slide_to_rest(plant, drive, direction, t, h, phi, v, z):
    """Find the state where the velocity, which changes sign within h, is zero, and the time that it took."""
    low, v_low, high = 0.0, v, h
    v_high = slide(plant, drive, direction, t, h, phi, v, z)[1]
    middle = h
    for _ in range(3):  # regula falsi; the velocity is nearly straight over a step, so three are plenty
        middle = low + (high - low) * v_low / (v_low - v_high)
        v_middle = slide(plant, drive, direction, t, middle, phi, v, z)[1]
        if v_middle * direction > 0:
            low, v_low = middle, v_middle
        else:
            high, v_high = middle, v_middle
    phi, _, z = slide(plant, drive, direction, t, middle, phi, v, z)
    return phi, z, middle


@njit(cache=True)
def advance(plant, drive, t, h, phi, v, z):
    """Move the state on by h seconds, with sticking."""
    if plant.coulomb + plant.stribeck == 0.0:
        return slide(plant, drive, 0.0, t, h, phi, v, z)
    done = 0.0
    if v != 0.0:
        direction = 1.0 if v > 0 else -1.0
        phi_end, v_end, z_end = slide(plant, drive, direction, t, h, phi, v, z)
        if v_end * direction > 0:
            return phi_end, v_end, z_end
        phi, z, done = slide_to_rest(plant, drive, direction, t, h, phi, v, z)
    torque = net_torque(plant, drive, t + done, phi, 0.0, z)
    if abs(torque) <= dry_friction(plant, 0.0):
        return phi, 0.0, z
    direction = 1.0 if torque > 0 else -1.0
    phi_end, v_end, z_end = slide(plant, drive, direction, t + done, h - done, phi, 0.0, z)
    # A torque that turns around within what is left of the step leaves the body at rest.
    return (phi_end, v_end, z_end) if v_end * direction > 0 else (phi, 0.0, z)


@njit(cache=True)
def integrate(plant, u, dt, records, substeps, delay, lag, fade):
    """Integrate (phi, phi') [T * records, 2] from rest, `records` rows to each of the T inputs held for dt.

    u [T] V, delay in steps of dt / (records * substeps), lag in s, fade the share of the gain lost at the
    end. phi' is the velocity of the row's instant, before the input of that instant takes effect.
    """
    steps_per_input = records * substeps
    h = dt / steps_per_input
    motion = np.empty((len(u) * records, 2))
    phi, v, z, voltage = 0.0, 0.0, 0.0, 0.0
    for step in range(len(u) * steps_per_input):
        if step % substeps == 0:
            motion[step // substeps, 0] = phi
            motion[step // substeps, 1] = v
        source = (step - delay) // steps_per_input
        target = u[source] if source >= 0 else 0.0
        if lag == 0.0:
            voltage = target
        drive = Drive(target, voltage, step * h, 1.0 / lag if lag > 0 else 0.0, fade / (len(u) * dt))
        phi, v, z = advance(plant, drive, step * h, h, phi, v, z)
        if lag > 0.0:
            voltage = target + (voltage - target) * exp(-h / lag)
    return motion


@njit(cache=True)
def play(u, width):
    """Pass u [T] through backlash: the output [T] follows only where u leaves a gap of the given width around it."""
    played = np.empty_like(u)
    last = 0.0
    for k in range(len(u)):
        last = min(max(last, u[k] - width / 2), u[k] + width / 2)
        played[k] = last
    return played
