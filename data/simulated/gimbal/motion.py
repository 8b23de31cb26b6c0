"""The gimbal's measured response to a voltage: drive, motion, sensors."""

from __future__ import annotations

from math import radians

import numpy as np
from jaxtyping import Float
from numpy.random import Generator

from simgap.data.simulated.gimbal.kernels import Plant, integrate, play
from simgap.data.simulated.gimbal.parameters import Gimbal
from simgap.data.simulated.gimbal.sensors import measure

DT = 0.1  # s, one input
RECORDS = 20  # measurements to an input: 200 Hz
SUBSTEPS = 10  # integration steps to a measurement: 2 kHz


def simulate_gimbal(
    parameters: Gimbal, u: Float[np.ndarray, "T 1"], rng: Generator, substeps: int = SUBSTEPS
) -> Float[np.ndarray, "T 2"]:
    """Measure y [T, 2] = (phi, phi_dot) in deg and deg/s, from rest; y[k] is read before u[k] takes effect.

    u [T, 1] V is held for 0.1 s, the motion integrated in `substeps` steps per 5 ms, measured at 200 Hz, and
    every 20th measurement kept. Each source of chance has a stream of its own, spawned from `rng`.
    """
    drive = _drive(parameters, u[:, 0])  # [T]
    delay = round(parameters.input_delay / DT * RECORDS * substeps)
    motion = integrate(  # [20 T, 2]
        _plant(parameters), drive, DT, RECORDS, substeps, delay, parameters.actuator_lag, parameters.gain_fade
    )
    readings = measure(parameters, np.rad2deg(motion), DT / RECORDS, rng)  # [20 T, 2]
    return readings[::RECORDS].copy()  # a copy, so that it does not hold on to the measurements thrown away


def _drive(parameters: Gimbal, u: Float[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
    """Compute the motor's voltage before delay and lag: gap, dead zone, gain, limit; a held input stays held."""
    u = play(u, parameters.backlash)
    u = np.sign(u) * np.maximum(np.abs(u) - parameters.dead_zone, 0.0)
    u = u * np.where(u > 0, 1 + parameters.asymmetric_gain, 1 - parameters.asymmetric_gain)
    return np.clip(u, -parameters.voltage_limit, parameters.voltage_limit)


def _plant(parameters: Gimbal) -> Plant:
    return Plant(
        inertia=parameters.inertia,
        gain=parameters.torque_per_volt,
        damping=parameters.damping,
        coulomb=parameters.coulomb,
        stribeck=parameters.stribeck,
        stribeck_velocity=radians(parameters.stribeck_velocity),
        drag=parameters.quadratic_drag,
        stiffness=parameters.cable_stiffness,
        stiffness2=parameters.quadratic_stiffness,
        stiffness3=parameters.cubic_stiffness,
        position_torque=parameters.position_torque,
        position_frequency=1 / radians(parameters.position_period),
        position_phase=parameters.position_phase,
        load=parameters.constant_load,
        periodic=parameters.periodic_disturbance,
        periodic_frequency=parameters.periodic_frequency,
        hysteresis=parameters.hysteresis,
        hysteresis_width=radians(parameters.hysteresis_width),
    )
