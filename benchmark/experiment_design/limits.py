"""Within which limits of input, rate, time and travel a record may be taken."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.records import Channel, Dataset, Experiment, UnusableInput

LONGEST = 2000  # samples of a record that nobody asked to be longer
MOST = 100_000  # samples of a record that somebody asked for
Range = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Limits:
    """What a record may hold: inputs between low and high, no faster than rate (per s), outputs within the travel.

    `moved` are the inputs that a signal is designed for; the others keep one of the rows `held`.
    """

    low: Float[np.ndarray, " nu"]
    high: Float[np.ndarray, " nu"]
    rate: Float[np.ndarray, " nu"]
    seconds: float
    travel_low: Float[np.ndarray, " ny"]
    travel_high: Float[np.ndarray, " ny"]
    dt: float
    moved: tuple[int, ...]
    held: Float[np.ndarray, "R nu"]

    @property
    def samples(self) -> int:
        """Length of the record in samples."""
        return max(2, round(self.seconds / self.dt))

    def longer(self, times: int) -> Limits:
        """Return the same limits for a longer record."""
        return replace(self, seconds=min(times * self.seconds, max(self.seconds, LONGEST * self.dt)))

    def relaxed(self, factor: float = 2.0) -> dict[str, Limits]:
        """Return the limits with each of them in turn, and then all, wider by a factor."""
        middle, half = (self.low + self.high) / 2, factor * (self.high - self.low) / 2
        travelled = (self.travel_low + self.travel_high) / 2
        way = factor * (self.travel_high - self.travel_low) / 2
        wider: dict[str, dict[str, Any]] = {
            "range of the input": {"low": middle - half, "high": middle + half},
            "rate of the input": {"rate": factor * self.rate},
            "length of the record": {"seconds": factor * self.seconds},
            "travel": {"travel_low": travelled - way, "travel_high": travelled + way},
        }
        everything = {name: value for changes in wider.values() for name, value in changes.items()}
        limits: dict[str, Limits] = {name: replace(self, **changes) for name, changes in wider.items()}
        return limits | {"all limits": replace(self, **everything)}


def limits_of(
    dataset: Dataset,
    input_range: Range | Mapping[str, Range] | None = None,
    rate: float | Mapping[str, float] | None = None,
    seconds: float | None = None,
    travel: Range | Mapping[str, Range] | None = None,
) -> Limits:
    """Take the limits that are given; else the range, the rate and the length that the training records show.

    Without names a limit belongs to the only input that moves, or to the only output. Raises UnusableInput.
    """
    experiments, inputs = (*dataset.training.train, *dataset.training.valid), dataset.channels.inputs
    moved = _moved(experiments, dataset)
    u, y = (np.concatenate([getattr(x, name) for x in experiments]) for name in ("u", "y"))
    fastest = np.max([np.max(np.abs(np.diff(x.u, axis=0)), axis=0, initial=0.0) for x in experiments], axis=0)
    low, high, rates = u.min(axis=0), u.max(axis=0), fastest / dataset.training.dt
    if not moved:
        raise UnusableInput(f"{dataset.name}: no input moves within a record, so there is nothing to design")
    for i, (first, last) in _by_channel("input range", input_range, inputs, moved).items():
        low[i], high[i] = _ordered("input range", first, last)
    for i, value in _by_channel("rate", rate, inputs, moved).items():
        rates[i] = value
        if not 0 < value < np.inf:
            raise UnusableInput(f"rate {value:g}: give a finite number above zero, so that the input can move")
    travel_low, travel_high = y.min(axis=0), y.max(axis=0)
    every = tuple(range(y.shape[1]))
    for j, (first, last) in _by_channel("travel", travel, dataset.channels.outputs, every).items():
        travel_low[j], travel_high[j] = _ordered("travel", first, last)
    dt = dataset.training.dt
    usual = min(dt * LONGEST, dt * max(len(x) for x in dataset.training.train))
    wanted = usual if seconds is None else seconds
    if not np.isfinite(wanted):
        raise UnusableInput(f"seconds {wanted:g}: give a finite number of seconds")
    if wanted < dt * 2 * dataset.n_init:
        least = 2 * dataset.n_init
        raise UnusableInput(f"seconds {wanted:g}: a record needs {least} samples, that is {least * dt:g} s, or more")
    if wanted > MOST * dt:
        raise UnusableInput(f"seconds {wanted:g}: a record may have {MOST} samples at most, that is {MOST * dt:g} s")
    held = np.unique(np.stack([np.where(np.isin(range(u.shape[1]), moved), 0.0, x.u.max(axis=0)) for x in experiments]),
                     axis=0)  # fmt: skip
    return Limits(low, high, rates, wanted, travel_low, travel_high, dt, moved, held)


def _moved(experiments: Sequence[Experiment], dataset: Dataset) -> tuple[int, ...]:
    """List the inputs that move within records; of a known machine only the one that drives it."""
    known = dataset.channels.plant
    if known is not None:
        return ([channel.name for channel in dataset.channels.inputs].index(known.input),)
    moves = np.any([np.ptp(x.u, axis=0) > 0 for x in experiments], axis=0)
    return tuple(int(i) for i in np.flatnonzero(moves))


def _by_channel(option: str, given: Any, channels: Sequence[Channel], usual: Sequence[int]) -> dict[int, Any]:
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        if len(usual) != 1:
            names = ", ".join(channels[i].name for i in usual)
            raise UnusableInput(f"{option}: say of which column, there are {names}")
        return {usual[0]: given}
    names = [channel.name for channel in channels]
    for name in given:
        if name not in names:
            raise UnusableInput(f"{option}: there is no column {name!r}; there are {', '.join(names)}")
        if names.index(name) not in usual:
            raise UnusableInput(f"{option}: {name!r} does not move within a record, and stays as it is in a new one")
    return {names.index(name): value for name, value in given.items()}


def _ordered(option: str, low: float, high: float) -> Range:
    if not -np.inf < low < high < np.inf:
        raise UnusableInput(f"{option} {low:g},{high:g}: give the lower limit first, then the upper one")
    return low, high
