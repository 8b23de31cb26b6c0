"""What an error is held against: motion, input and time, and their bins.

Motion is that of the simulation. The measurement's own noise is part of the error, so bins of the measured output
would find an effect in noise alone; and its derivative is mostly noise.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from simgap.error_views.wording import between, span
from simgap.wording import amount

LEAST = 20  # samples in a bin
MOST = 10  # bins
REST = 0.02  # of the RMS velocity; slower is at rest


@dataclass(frozen=True, eq=False)
class Bins:
    """Samples sorted into bins: the bin of each (-1: none), the centres [unit of the variable], the places in words.

    `ends` are the limits of each bin, infinite at the outer ones; `parents` the coarser bin of each, where it has one.
    """

    labels: Int[np.ndarray, " N"]
    centres: tuple[float, ...]
    where: tuple[str, ...]
    ends: tuple[tuple[float, float], ...] = ()
    parents: tuple[int, ...] = ()


def bin_values(values: Float[np.ndarray, " N"], name: str, unit: str, most: int = MOST) -> Bins | None:
    """Bins by quantiles of the variable, or by its values where it has few; None where it says nothing.

    Samples at which the variable is NaN are in no bin. In words: "where the {name} is above 3.1 V".
    """
    known = np.isfinite(values)
    used = values[known]
    least = min(LEAST, len(used) // 2)
    if least < 2 or np.ptp(used) <= 1e-9 * np.abs(used).max():
        return None
    distinct = np.unique(used)
    few = len(distinct) <= most
    if few:
        edges = (distinct[1:] + distinct[:-1]) / 2
    else:
        wanted = int(np.clip(len(used) // least, 2, most))
        edges = np.unique(np.quantile(used, np.arange(1, wanted) / wanted))
    inside, edges = _merge(used, edges, least)
    if len(edges) == 0:
        return None
    count = np.bincount(inside)
    centres = np.bincount(inside, used) / count
    single = few and len(edges) == len(distinct) - 1
    outer = [-np.inf, *map(float, edges), np.inf]
    ends = tuple(pairwise(outer))
    labels = np.full(len(values), -1)
    labels[known] = inside
    places = [amount(value, unit) for value in distinct] if single else [between(*limits, unit) for limits in ends]
    return Bins(labels, tuple(map(float, centres)), tuple(f"where the {name} is {place}" for place in places), ends)


def _merge(
    used: Float[np.ndarray, " n"], edges: Float[np.ndarray, " m"], least: int
) -> tuple[Int[np.ndarray, " n"], np.ndarray]:
    """The bin of each value, once the bins with fewer than `least` samples have joined their smaller neighbour."""
    while True:
        inside = np.searchsorted(edges, used, side="right")
        count = np.bincount(inside, minlength=len(edges) + 1)
        small = int(np.argmin(count))
        if len(edges) == 0 or count[small] >= least:
            return inside, edges
        left = small > 0 and (small == len(edges) or count[small - 1] <= count[small + 1])
        edges = np.delete(edges, small - 1 if left else small)


def bin_direction(v: Float[np.ndarray, " N"], unit: str) -> Bins | None:
    """Bins by the sign of the velocity: back, forwards, and at rest where there is rest."""
    verb = "turning" if unit.startswith(("deg", "rad", "°")) else "moving"
    label, words = direction(v) + 1, (f"when {verb} back", "at rest", f"when {verb} forwards")
    count = np.bincount(label, minlength=3)
    least = min(LEAST, len(v) // 4)
    if least < 2 or min(count[0], count[2]) < least:
        return None
    kept = [b for b in range(3) if count[b] >= least]
    new = np.full(3, -1)
    new[kept] = np.arange(len(kept))
    return Bins(new[label], tuple(float(b - 1) for b in kept), tuple(words[b] for b in kept))


def bin_reversals(v: Float[np.ndarray, " N"], lengths: Sequence[int], dt: float, unit: str) -> Bins | None:
    """Bins by the time since the velocity changed its sign, for each direction; its parents are the directions.

    Backlash errs one way after one reversal and the other way after the next, so without the direction it cancels.
    Centres are in seconds, negative for motion back.
    """
    verb = "turning" if unit.startswith(("deg", "rad", "°")) else "moving"
    since, way = by_experiment(lambda part: since_reversal(part) * dt, v, lengths), np.sign(direction(v))
    labels = np.full(len(v), -1)
    centres: list[float] = []
    where: list[str] = []
    parents: list[int] = []
    for sign, word in ((-1, "back"), (1, "forwards")):
        # An unknown time (before the first reversal) and a sample at rest belong to neither direction.
        bins = bin_values(np.where(way == sign, since, np.nan), "time", "s", MOST // 2)
        if bins is None:
            return None
        labels = np.where(bins.labels >= 0, bins.labels + len(centres), labels)
        centres += [sign * centre for centre in bins.centres]
        where += [f"{span(*limits)} after it began {verb} {word}" for limits in bins.ends]
        parents += [(sign + 1) // 2] * len(bins.centres)
    return Bins(labels, tuple(centres), tuple(where), parents=tuple(parents))


def direction(v: Float[np.ndarray, " N"]) -> Int[np.ndarray, " N"]:
    """-1 moving back, 0 at rest, 1 moving forwards."""
    slow = REST * np.sqrt(np.mean(v**2))
    return np.where(np.abs(v) <= slow, 0, np.sign(v)).astype(int)


def since_reversal(v: Float[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
    """Samples since the velocity last changed its sign; NaN before the first change. Rest is no change."""
    sample = np.arange(len(v))
    way = direction(v)
    last = np.maximum.accumulate(np.where(way != 0, sample, 0))  # the last sample in motion
    turned = np.zeros(len(v), dtype=bool)
    turned[1:] = way[last][1:] * way[last][:-1] < 0
    start = np.maximum.accumulate(np.where(turned, sample, -1))
    return np.where(start >= 0, (sample - start).astype(float), np.nan)


def derivative(values: Float[np.ndarray, " T"], dt: float) -> Float[np.ndarray, " T"]:
    """Central differences [unit/s]."""
    return np.gradient(values, dt) if len(values) > 1 else np.zeros(len(values))


def amplitude(values: Float[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
    """Local RMS about the local mean, over a tenth of the record but 5 to 100 samples."""
    width = min(len(values), int(np.clip(len(values) // 10, 5, 100)))
    centred = values - values.mean()
    start = np.clip(np.arange(len(values)) - width // 2, 0, len(values) - width)
    first, second = (np.concatenate([[0.0], np.cumsum(centred**power)]) for power in (1, 2))
    mean, square = ((total[start + width] - total[start]) / width for total in (first, second))
    return np.sqrt(np.maximum(square - mean**2, 0))


def by_experiment(
    function: Callable[[np.ndarray], np.ndarray], values: Float[np.ndarray, " N"], lengths: Sequence[int]
) -> Float[np.ndarray, " N"]:
    """The function of each experiment's part of `values`, end to end."""
    return np.concatenate([function(part) for part in np.split(values, np.cumsum(lengths)[:-1])])
