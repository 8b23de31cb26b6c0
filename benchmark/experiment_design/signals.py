"""Test signals of a few numbers each, within limits of value and rate."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float
from numpy.random import Generator

Kind = Literal["switching", "steps", "sines", "chirp", "triangles"]
KINDS: tuple[Kind, ...] = ("switching", "steps", "sines", "chirp", "triangles")
SINES = 6
OCTAVES = 8.0  # the slowest sine, or the begin of a chirp, has so many times the period of the fastest


@dataclass(frozen=True)
class Shape:
    """A signal: `size` is its share of the range, `centre` (-1 to 1) where in the rest of it, `period` that of its
    fastest part in samples, `seed` what draws levels, holds and phases.
    """

    kind: Kind
    size: float
    centre: float
    period: float
    seed: int

    def within_one(self, samples: int) -> Float[np.ndarray, " T"]:
        """Draw the signal between -1 and 1."""
        rng = np.random.default_rng(self.seed)
        if self.kind in ("switching", "steps"):
            return _levels(samples, self.period / 2, self.kind == "switching", rng)
        if self.kind == "triangles":
            return _triangles(samples, self.period / 2, rng)
        if self.kind == "chirp":
            return _chirp(samples, self.period, rng)
        periods = self.period * np.geomspace(1.0, OCTAVES, SINES)
        waves = np.sin(2 * np.pi * (np.arange(samples)[:, None] / periods + rng.random(SINES))).sum(axis=1)
        return waves / np.max(np.abs(waves))

    def between(self, low: float, high: float, samples: int) -> Float[np.ndarray, " T"]:
        """Draw the signal between two limits."""
        middle, half = (low + high) / 2, (high - low) / 2
        return middle + half * ((1 - self.size) * self.centre + self.size * self.within_one(samples))

    def varied(self, samples: int, rng: Generator) -> Shape:
        """Return a signal near this one."""
        return replace(
            self,
            size=float(np.clip(self.size * np.exp(0.3 * rng.standard_normal()), 0.01, 1.0)),
            centre=float(np.clip(self.centre + 0.4 * rng.standard_normal(), -1.0, 1.0)),
            period=float(np.clip(self.period * np.exp(0.4 * rng.standard_normal()), 2.0, samples)),
            seed=int(rng.integers(1 << 30)) if rng.random() < 0.5 else self.seed,
        )


def grid(samples: int, periods: int = 6, sizes: tuple[float, ...] = (1.0, 0.5, 0.2)) -> list[Shape]:
    """List signals of every kind, from fast to slow, large and small, around the middle of the range."""
    fast_to_slow = np.geomspace(4.0, samples, periods)
    tried: list[tuple[Kind, float, float]] = [(k, float(p), s) for k in KINDS for p in fast_to_slow for s in sizes]
    return [Shape(kind, size, 0.0, period, seed) for seed, (kind, period, size) in enumerate(tried)]


def slowed(u: Float[np.ndarray, "E T"], rate: float, dt: float) -> Float[np.ndarray, "E T"]:
    """Follow signals no faster than `rate` (their unit per second)."""
    step, followed = rate * dt, u.copy()
    if np.max(np.abs(np.diff(u, axis=1)), initial=0.0) <= step * (1 + 1e-9):
        return followed
    for k in range(1, u.shape[1]):
        followed[:, k] = followed[:, k - 1] + np.clip(u[:, k] - followed[:, k - 1], -step, step)
    return followed


def _levels(samples: int, hold: float, two: bool, rng: Generator) -> Float[np.ndarray, " T"]:
    """Hold each of a row of levels for half to one and a half of `hold` samples; with `two` only -1 and 1, by turns."""
    count = 2 + int(2 * samples / max(hold, 1.0))
    lengths = np.maximum(1, np.round(hold * rng.uniform(0.5, 1.5, count))).astype(int)
    levels = (-1.0) ** np.arange(count) if two else rng.uniform(-1.0, 1.0, count)
    return np.repeat(levels, lengths)[:samples]


def _triangles(samples: int, way: float, rng: Generator) -> Float[np.ndarray, " T"]:
    """Ramp to and fro between turning points of either sign, about `way` samples apart."""
    count = 2 + int(2 * samples / max(way, 1.0))
    turns = np.concatenate(([0.0], np.cumsum(np.maximum(1.0, way * rng.uniform(0.5, 1.5, count)))))
    peaks = rng.uniform(0.4, 1.0, count + 1) * (-1.0) ** np.arange(count + 1)
    peaks[0] = 0.0
    return np.interp(np.arange(samples), turns, peaks)


def _chirp(samples: int, period: float, rng: Generator) -> Float[np.ndarray, " T"]:
    """Make a sine whose period falls to `period` samples."""
    k, fast = np.arange(samples) / samples, samples / period
    slow = fast / OCTAVES
    return np.sin(2 * np.pi * (slow * k + (fast - slow) * k**2 / 2 + rng.random()))
