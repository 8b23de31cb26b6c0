"""What the machines are asked for: set points of a controller, or inputs; and the slow disturbance."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy.random import Generator

from simgap.data.simulated.field.machines import Plant
from simgap.data.simulated.signals import ramps, sines, steps


def draw_wanted(plant: Plant, number: int, samples: int, rng: Generator) -> Float[np.ndarray, "T nu"]:
    """Draw steps, sines or ramps by turns, of an amplitude of their own, about the operating point."""
    shapes = (_steps, _sines, _ramps)
    columns = [shapes[(number + i) % 3](samples, rng) * rng.uniform(0.6, 1.0) for i in range(len(plant.scale))]
    return np.array(plant.middle) + np.array(plant.scale) * np.stack(columns, axis=1)


def _steps(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    levels = steps(samples, 6, 40, rng)
    return levels - levels.mean()


def _sines(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    return sines(samples, 120, 5, rng)


def _ramps(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    return ramps(samples, 15, 50, rng)


def slow_disturbance(samples: int, rng: Generator) -> Float[np.ndarray, " n"]:
    """Add three sines with periods of 0.7 to 3 records; of standard deviation about 1 over many records."""
    cycles, phases = 1 / rng.uniform(0.7, 3.0, 3), rng.random(3)
    return np.sin(2 * np.pi * (np.arange(samples)[:, None] / samples * cycles + phases)).sum(axis=1) / np.sqrt(1.5)
