"""Signals that simulated machines are driven with, and recordings put into splits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy.random import Generator
from scipy.signal import lfilter

from simgap.records import Channels, Dataset, Experiment, TrainingSet


def steps(samples: int, shortest: int, longest: int, rng: Generator) -> Float[np.ndarray, " T"]:
    """Draw levels within 1, each held for `shortest` to `longest` samples."""
    holds = rng.integers(shortest, longest + 1, samples // shortest)
    return np.repeat(rng.uniform(-1.0, 1.0, len(holds)), holds)[:samples]


def sines(samples: int, longest: int, count: int, rng: Generator) -> Float[np.ndarray, " T"]:
    """Add so many sines with periods of 12 to `longest` samples; the largest value is 1."""
    periods = np.geomspace(12, longest, count) * rng.uniform(0.85, 1.15, count)
    waves = np.sin(2 * np.pi * (np.arange(samples)[:, None] / periods + rng.random(count))).sum(axis=1)  # [T]
    return waves / np.abs(waves).max()


def ramps(samples: int, shortest: int, longest: int, rng: Generator) -> Float[np.ndarray, " T"]:
    """Draw ramps to and fro between turning points of either sign, `shortest` to `longest` samples apart."""
    turns = np.cumsum(rng.integers(shortest, longest + 1, samples // shortest + 2)) - shortest
    peaks = rng.uniform(0.4, 1.0, len(turns)) * (-1.0) ** (np.arange(len(turns)) + rng.integers(2))
    return np.interp(np.arange(samples), turns, peaks)


def coloured_noise(
    shape: int | tuple[int, ...], colour: float, rng: Generator
) -> Float[np.ndarray, " T"] | Float[np.ndarray, "T n"]:
    """Draw stationary AR(1) noise of variance 1 along the first axis, `colour` its correlation from row to row."""
    draws = rng.standard_normal(shape)
    draws[1:] *= np.sqrt(1 - colour**2)
    return np.asarray(lfilter([1.0], [1.0, -colour], draws, axis=0))


def lagged(motion: Float[np.ndarray, " n"], lag: float, h: float) -> Float[np.ndarray, " n"]:
    """Solve lag x' + x = motion from x = 0, exactly where the motion is straight between its rows, h apart."""
    keep = np.exp(-h / lag)
    old = lag / h * (1 - keep) - keep  # weight of the row before
    return np.asarray(lfilter([1 - keep - old, old], [1, -keep], motion))


def in_splits(
    name: str, records: Sequence[Experiment], counts: Sequence[int], n_init: int, channels: Channels
) -> Dataset:
    """Make a data set of records that come in order: those to train on, to validate on, and to test on."""
    ends = np.cumsum(counts)
    train, valid, test = tuple(records[: ends[0]]), tuple(records[ends[0] : ends[1]]), tuple(records[ends[1] :])
    return Dataset(name, TrainingSet(train, valid, n_init, channels), test, n_init, channels)
