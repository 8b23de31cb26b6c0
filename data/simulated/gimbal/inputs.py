"""The four kinds of voltage that the gimbal is driven with, at 10 Hz within 8 V (paper, section 2.3)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from numpy.random import Generator

LIMIT = 8.0  # V, where the authors saturate every signal
GAUSSIAN_STD = 3.5  # V, so that one sample in 45 meets the limit
BINARY_LEVEL = 4.5  # V


def gaussian(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    """Draw white noise with a Gaussian distribution, cut off at the limit. V."""
    return np.clip(rng.normal(0.0, GAUSSIAN_STD, samples), -LIMIT, LIMIT)


def binary(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    """Draw one of two levels of opposite sign, anew for every sample. V."""
    return BINARY_LEVEL * rng.choice(np.array([-1.0, 1.0]), samples)


def uniform(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    """Draw voltages of which every one within the limit is equally likely. V."""
    return rng.uniform(-LIMIT, LIMIT, samples)


def joystick(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    """Draw pushes of a hand on a stick: up smoothly, held, back smoothly, often to the other side, with pauses. V.

    During a pause the stick stands in its centre and the voltage is exactly zero.
    """
    side = rng.choice(np.array([-1.0, 1.0]))
    parts: list[np.ndarray] = [np.zeros(rng.integers(3, 12))]
    while sum(map(len, parts)) < samples:
        level = side * rng.uniform(1.5, 7.5)
        rise, fall = (_ramp(int(n)) for n in rng.integers(2, 8, 2))  # [n] from 0 to 1
        tremble = rng.normal(1.0, 0.03, rng.integers(1, 11))  # no hand holds a stick quite still
        parts += [level * rise, level * tremble, level * fall[::-1]]
        if rng.random() < 0.5:
            parts.append(np.zeros(rng.integers(5, 21)))
        # Who plays with a gimbal looks to and fro, so the other side is likelier than the same again.
        side = -side if rng.random() < 0.8 else side
    return np.clip(np.concatenate(parts)[:samples], -LIMIT, LIMIT)


def _ramp(samples: int) -> Float[np.ndarray, " n"]:
    return 0.5 - 0.5 * np.cos(np.pi * np.arange(1, samples + 1) / (samples + 1))


INPUTS: dict[str, Callable[[int, Generator], np.ndarray]] = {
    "gaussian": gaussian,
    "binary": binary,
    "uniform": uniform,
    "joystick": joystick,
}
