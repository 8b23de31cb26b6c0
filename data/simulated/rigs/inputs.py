"""The four kinds of input that the rigs are driven with."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy.random import Generator

from simgap.data.simulated.rigs.plants import Rig

KINDS = ("steps", "sines", "triangle", "chirp")  # of input, by turns


def draw_input(rig: Rig, kind: str, rng: Generator) -> Float[np.ndarray, " T"]:
    """Draw the input of one experiment, held from sample to sample, of an amplitude of its own. U."""
    signal = {"steps": _steps, "sines": _sines, "triangle": _triangle, "chirp": _chirp}[kind](rig.samples, rng)
    u = rig.amplitude * rng.uniform(0.5, 1.0) * signal
    # A pump neither turns back nor exceeds its supply; both ends are reached, so that levels vary widely.
    return np.clip(rig.amplitude + 1.3 * u, 0.0, rig.largest_input) if rig.outflow else u


def _steps(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    """Draw levels within 1, each held for 5 to 25 samples."""
    holds = rng.integers(5, 26, samples // 5)
    return np.repeat(rng.uniform(-1.0, 1.0, len(holds)), holds)[:samples]


def _sines(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    """Add six sines with periods of 12 to 150 samples; the largest value is 1."""
    periods = np.geomspace(12, 150, 6) * rng.uniform(0.85, 1.15, 6)
    waves = np.sin(2 * np.pi * (np.arange(samples)[:, None] / periods + rng.random(6))).sum(axis=1)  # [T]
    return waves / np.abs(waves).max()


def _triangle(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    """Draw slow ramps to and fro between turning points of either sign, 25 to 60 samples apart."""
    turns = np.cumsum(rng.integers(25, 61, samples // 25 + 2)) - 25
    peaks = rng.uniform(0.4, 1.0, len(turns)) * (-1.0) ** (np.arange(len(turns)) + rng.integers(2))
    return np.interp(np.arange(samples), turns, peaks)


def _chirp(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    """Make a sine whose period falls from about 120 to about 10 samples."""
    k = np.arange(samples) / samples
    slow, fast = samples / rng.uniform(100, 140), samples / rng.uniform(8, 14)  # periods per experiment
    return np.sin(2 * np.pi * (slow * k + (fast - slow) * k**2 / 2 + rng.random()))
