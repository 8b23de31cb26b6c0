"""The variables that an error is plotted against (motion, input, time), sorted into bins.

The motion is the simulated one. The noise of a measured output is also in the error, so that bins of the measurement
would find a dependence where there is only noise; and the derivative of a measurement is mostly noise.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from simgap.error_views.wording import between, span
from simgap.units import of_motion
from simgap.wording import amount

LEAST = 20  # samples in a bin
MOST = 10  # bins
REST = 0.02  # of the RMS velocity; what is slower counts as at rest


@dataclass(frozen=True, eq=False)
class Bins:
    """Samples sorted into bins of a variable.

    `labels` is the bin of each sample (-1: none), `centres` are in the unit of the variable, `where` says in words
    where each bin is. `ends` are the limits of each bin, infinite at the outer ones; `parents` the coarser bin of each,
    where it has one.
    """

    labels: Int[np.ndarray, " N"]
    centres: tuple[float, ...]
    where: tuple[str, ...]
    ends: tuple[tuple[float, float], ...] = ()
    parents: tuple[int, ...] = ()


def bin_values(values: Float[np.ndarray, " N"], name: str, unit: str, most: int = MOST) -> Bins | None:
    """Sort samples into bins between quantiles of a variable, or by its values where it has few.

    Samples at which the variable is NaN are in no bin. The words are like "where the {name} is above 3.1 V". None
    where there are too few samples, or where the variable is constant.
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
    ranges = [amount(value, unit) for value in distinct] if single else [between(*limits, unit) for limits in ends]
    return Bins(labels, tuple(map(float, centres)), tuple(f"where the {name} is {text}" for text in ranges), ends)


def _merge(
    used: Float[np.ndarray, " n"], edges: Float[np.ndarray, " m"], least: int
) -> tuple[Int[np.ndarray, " n"], np.ndarray]:
    """Merge bins of fewer than `least` samples into a neighbour; return the bin of each value, and the edges."""
    while True:
        inside = np.searchsorted(edges, used, side="right")
        count = np.bincount(inside, minlength=len(edges) + 1)
        small = int(np.argmin(count))
        if len(edges) == 0 or count[small] >= least:
            return inside, edges
        into_left = small > 0 and (small == len(edges) or count[small - 1] <= count[small + 1])
        edges = np.delete(edges, small - 1 if into_left else small)


def _verb(unit: str) -> str:
    return "turning" if of_motion(unit).kind == "angle" else "moving"


def bin_direction(v: Float[np.ndarray, " N"], unit: str) -> Bins | None:
    """Sort samples by the sign of the velocity: back, forwards, and at rest if enough samples are."""
    verb = _verb(unit)
    label, words = direction(v) + 1, (f"when {verb} back", "at rest", f"when {verb} forwards")
    count = np.bincount(label, minlength=3)
    least = min(LEAST, len(v) // 4)
    if least < 2 or min(count[0], count[2]) < least:
        return None
    filled = [b for b in range(3) if count[b] >= least]
    new = np.full(3, -1)
    new[filled] = np.arange(len(filled))
    return Bins(new[label], tuple(float(b - 1) for b in filled), tuple(words[b] for b in filled))


def bin_reversals(v: Float[np.ndarray, " N"], lengths: Sequence[int], dt: float, unit: str) -> Bins | None:
    """Sort samples by the time since the velocity changed its sign, separately for each direction (the parents).

    The error of backlash changes its sign from one reversal to the next, so that it would cancel without the direction.
    Centres are in s, negative for motion back.
    """
    verb = _verb(unit)
    since, signs = by_experiment(lambda part: since_reversal(part) * dt, v, lengths), np.sign(direction(v))
    labels = np.full(len(v), -1)
    centres: list[float] = []
    where: list[str] = []
    parents: list[int] = []
    for sign, word in ((-1, "back"), (1, "forwards")):
        # Samples at rest or before the first reversal belong to neither direction.
        bins = bin_values(np.where(signs == sign, since, np.nan), "time", "s", MOST // 2)
        if bins is None:
            return None
        labels = np.where(bins.labels >= 0, bins.labels + len(centres), labels)
        centres += [sign * centre for centre in bins.centres]
        where += [f"{span(*limits)} after it began {verb} {word}" for limits in bins.ends]
        parents += [(sign + 1) // 2] * len(bins.centres)
    return Bins(labels, tuple(centres), tuple(where), parents=tuple(parents))


def direction(v: Float[np.ndarray, " N"]) -> Int[np.ndarray, " N"]:
    """Return the direction of motion: -1 back, 0 at rest, 1 forwards."""
    slow = REST * np.sqrt(np.mean(v**2))
    return np.where(np.abs(v) <= slow, 0, np.sign(v)).astype(int)


def since_reversal(v: Float[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
    """Count the samples since the velocity last changed its sign; NaN before the first change. Rest is no change."""
    sample = np.arange(len(v))
    sign = direction(v)
    last = np.maximum.accumulate(np.where(sign != 0, sample, 0))  # the last sample in motion
    turned = np.zeros(len(v), dtype=bool)
    turned[1:] = sign[last][1:] * sign[last][:-1] < 0
    start = np.maximum.accumulate(np.where(turned, sample, -1))
    return np.where(start >= 0, (sample - start).astype(float), np.nan)


def derivative(values: Float[np.ndarray, " T"], dt: float) -> Float[np.ndarray, " T"]:
    """Differentiate by central differences [unit/s]."""
    return np.gradient(values, dt) if len(values) > 1 else np.zeros(len(values))


def amplitude(values: Float[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
    """Compute the RMS about the local mean in a moving window: a tenth of the record, but 5 to 100 samples."""
    width = min(len(values), int(np.clip(len(values) // 10, 5, 100)))
    centred = values - values.mean()
    start = np.clip(np.arange(len(values)) - width // 2, 0, len(values) - width)
    first, second = (np.concatenate([[0.0], np.cumsum(centred**power)]) for power in (1, 2))
    mean, square = ((total[start + width] - total[start]) / width for total in (first, second))
    return np.sqrt(np.maximum(square - mean**2, 0))


def by_experiment(
    function: Callable[[np.ndarray], np.ndarray], values: Float[np.ndarray, " N"], lengths: Sequence[int]
) -> Float[np.ndarray, " N"]:
    """Apply a function to the values of each experiment and put the results end to end."""
    return np.concatenate([function(part) for part in np.split(values, np.cumsum(lengths)[:-1])])
