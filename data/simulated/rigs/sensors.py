"""What the sensors of a rig make of its true motion."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf

import numpy as np
from jaxtyping import Float
from numpy.random import Generator

from simgap.data.simulated.rigs.plants import Rig
from simgap.data.simulated.signals import coloured_noise, lagged


def measure(
    rig: Rig,
    size: Mapping[str, float],
    motion: Float[np.ndarray, "n ny"],
    spread: Float[np.ndarray, " ny"],
    colour: float,
    rng: Generator,
    substeps: int,
) -> Float[np.ndarray, "T ny"]:
    """Read the motion at the samples: lag, absolute value, curve, drift and bias, noise, limit, counts, outliers."""
    drift_rng, bias_rng, noise_rng, outlier_rng = rng.spawn(4)
    y = motion[::substeps].copy()
    first = motion[:, 0]
    if lag := size.get("sensor_lag", 0.0):
        first = first[0] + lagged(first - first[0], lag, rig.dt / substeps)  # settled before the first sample
    reading = first[::substeps].copy()
    if "absolute" in size:
        reading = np.abs(reading)
    reading += size.get("sensor_squared", 0.0) * reading * (np.abs(reading) / rig.reach - 1)
    reading += size.get("bias", 0.0) * bias_rng.standard_normal()
    reading += size.get("drift", 0.0) * drift_rng.standard_normal() * rig.dt * np.arange(len(reading))
    y[:, 0] = reading
    y += spread * coloured_noise(y.shape, colour, noise_rng)
    limit, step = size.get("sensor_limit", inf), size.get("step", 0.0)
    y[:, 0] = np.clip(y[:, 0], -limit, limit)
    if step:
        y[:, 0] = step * np.round(y[:, 0] / step)
    hit = outlier_rng.random(len(y)) < size.get("outlier_rate", 0.0)
    y[:, 0] += rig.outlier * hit * outlier_rng.choice(np.array([-1.0, 1.0]), len(y))
    return y
