"""The four kinds of input that the rigs are driven with."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy.random import Generator

from simgap.data.simulated.rigs.plants import Rig
from simgap.data.simulated.signals import ramps, sines, steps

KINDS = ("steps", "sines", "triangle", "chirp")  # of input, by turns


def draw_input(rig: Rig, kind: str, rng: Generator) -> Float[np.ndarray, " T"]:
    """Draw the input of one experiment, held from sample to sample, of an amplitude of its own. U."""
    signal = {"steps": _steps, "sines": _sines, "triangle": _triangle, "chirp": _chirp}[kind](rig.samples, rng)
    u = rig.amplitude * rng.uniform(0.5, 1.0) * signal
    # A pump neither turns back nor exceeds its supply; both ends are reached, so that levels vary widely.
    return np.clip(rig.amplitude + 1.3 * u, 0.0, rig.largest_input) if rig.outflow else u


def _steps(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    return steps(samples, 5, 25, rng)


def _sines(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    return sines(samples, 150, 6, rng)


def _triangle(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    return ramps(samples, 25, 60, rng)


def _chirp(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    """Make a sine whose period falls from about 120 to about 10 samples."""
    k = np.arange(samples) / samples
    slow, fast = samples / rng.uniform(100, 140), samples / rng.uniform(8, 14)  # periods per experiment
    return np.sin(2 * np.pi * (slow * k + (fast - slow) * k**2 / 2 + rng.random()))
