"""What the encoder and the gyro of the gimbal make of its motion."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy.random import Generator

from simgap.data.simulated.gimbal.parameters import Gimbal
from simgap.data.simulated.signals import coloured_noise, lagged

KEPT_EVERY = 0.1  # s; the noise's colour is stated between samples this far apart


def measure(
    parameters: Gimbal, motion: Float[np.ndarray, "n 2"], dt: float, rng: Generator
) -> Float[np.ndarray, "n 2"]:
    """Read (phi, phi_dot), [n, 2] in deg and deg/s every dt seconds.

    reading = outliers(round(clip(abs(lagged motion + bias + drift t + noise))))

    Every source of chance draws from its own stream, whether it is switched on or not, so that switching one
    on changes none of the others.
    """
    drift_rng, bias_rng, noise_rng, outlier_rng = rng.spawn(4)
    t = dt * np.arange(len(motion))[:, None]  # [n, 1]
    readings = motion.copy()
    for channel, lag in enumerate(parameters.sensor_lag):
        if lag > 0:
            readings[:, channel] = lagged(motion[:, channel], lag, dt)
    readings = readings + np.array(parameters.bias) * bias_rng.standard_normal(2)
    readings += np.array(parameters.drift) * drift_rng.standard_normal(2) * t
    colour = parameters.noise_colour ** (dt / KEPT_EVERY)
    readings += np.array(parameters.noise) * coloured_noise(readings.shape, colour, noise_rng)
    readings = np.where(parameters.absolute_sensor, np.abs(readings), readings)
    readings = np.clip(readings, -np.array(parameters.sensor_limit), parameters.sensor_limit)
    for channel, step in enumerate(parameters.quantisation):
        if step > 0:
            readings[:, channel] = step * np.round(readings[:, channel] / step)
    hit = outlier_rng.random(readings.shape) < parameters.outlier_rate  # [n, 2]
    sign = outlier_rng.choice(np.array([-1.0, 1.0]), readings.shape)
    return readings + hit * sign * np.array(parameters.outlier_size)
