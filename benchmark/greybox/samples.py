"""Measured samples as a fit needs them: experiments side by side, and excerpts of long ones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from simgap.greybox.past import Past
from simgap.records import Experiment

# The search uses so many samples, spread over the records; the final fit uses all.
SEARCH_SAMPLES = 5000
PIECE = 500
# Of the size of a signal: an error that is smaller is rounding, of a file or of a simulation, and means nothing.
RESOLUTION = 1e-9
# Of the step of a coarse reading: a normal density of less spread would give a reading a chance above one.
CELL = 1 / math.sqrt(2 * math.pi * math.e)
# Readings are taken to lie on a grid when this share of them are whole multiples of its step.
ON_GRID = 0.999
OFFSET = 1e-6  # the share of its largest value that a reading must move by to be no constant; more than rounding


@dataclass(frozen=True, eq=False)
class Records:
    """Experiments side by side; the shorter ones are padded with their last input and masked."""

    u: Float[np.ndarray, "E T nu"]
    y: Float[np.ndarray, "E T ny"]
    mask: Bool[np.ndarray, "E T"]
    dt: float
    past: Past
    soft: float = 0.0  # errors beyond it count by their size, not by its square; 0: all count by the square

    @classmethod
    def of(cls, experiments: Sequence[Experiment], outputs: Sequence[int]) -> Records:
        """Stack the chosen outputs of these experiments."""
        longest = max(map(len, experiments))

        def padded(values: np.ndarray) -> np.ndarray:
            return np.concatenate((values, np.repeat(values[-1:], longest - len(values), axis=0)))

        return cls(
            np.stack([padded(x.u) for x in experiments]),
            np.stack([padded(x.y[:, list(outputs)]) for x in experiments]),
            np.stack([np.arange(longest) < len(x) for x in experiments]),
            experiments[0].dt,
            Past.of(experiments),
        )

    @classmethod
    def measured(
        cls, u: Float[np.ndarray, "E T nu"], y: Float[np.ndarray, "E T ny"], dt: float,
        past: Past | None = None,
    ) -> Records:  # fmt: skip
        """Take records of one length, with every sample measured, that begin where their runs do if nothing is said."""
        return cls(np.ascontiguousarray(u), y, np.ones(y.shape[:2], dtype=bool), dt, past or Past.none(u))

    @cached_property
    def sizes(self) -> Float[np.ndarray, " ny"]:
        """Sizes of the outputs, in their units."""
        return sizes_of(self.y[self.mask])

    @cached_property
    def input_sizes(self) -> Float[np.ndarray, " nu"]:
        """Sizes of the inputs, in their units."""
        return sizes_of(self.u[self.mask])

    @property
    def rounding(self) -> Float[np.ndarray, " ny"]:
        """The largest error of each output that is rounding, of a file or of a simulation."""
        return RESOLUTION * self.sizes

    @cached_property
    def steps(self) -> Float[np.ndarray, " ny"]:
        """The step that the readings of each output come in; 0 where they come in none."""
        return np.array([quantisation_step(self.y[:, :, j]) for j in range(self.y.shape[2])])

    @property
    def resolution(self) -> Float[np.ndarray, " ny"]:
        """The smallest spread of a reading about what was expected of it that may count as likely, for each output."""
        return np.maximum(self.rounding, CELL * self.steps)

    def only(self, experiments: np.ndarray) -> Records:
        """Return some of the experiments."""
        u, y, mask = (values[experiments] for values in (self.u, self.y, self.mask))
        return Records(u, y, mask, self.dt, self.past.only(experiments), self.soft)

    def beginning(self, samples: int) -> Records:
        """Return the first samples of each experiment."""
        return self._between(0, samples)

    def halves(self) -> tuple[Records, Records]:
        """Deal out the experiments, or cut a single one in two."""
        if len(self.u) > 1:
            every = np.arange(len(self.u))
            return self.only(every[::2]), self.only(every[1::2])
        samples = self.mask.shape[1]
        return self._between(0, samples // 2), self._between(samples // 2, samples)

    def _between(self, first: int, last: int) -> Records:
        u, y, mask = (values[:, first:last] for values in (self.u, self.y, self.mask))
        past = self.past.at(np.array([first]), self.u, self.dt)
        return Records(np.ascontiguousarray(u), y, mask, self.dt, past, self.soft)

    def pieces(self, samples: int) -> Records:
        """Cut every experiment into pieces of so many samples; what is left over at its end is dropped."""
        count = self.mask.shape[1] // samples

        def cut(values: np.ndarray) -> np.ndarray:
            whole = values[:, : count * samples]
            return np.ascontiguousarray(whole.reshape(-1, samples, *values.shape[2:]))

        past = self.past.at(samples * np.arange(count), self.u, self.dt)
        return Records(cut(self.u), cut(self.y), cut(self.mask), self.dt, past, self.soft)

    @property
    def duration(self) -> float:
        """Duration of the longest experiment, in s."""
        return self.dt * self.mask.shape[1]

    @property
    def samples(self) -> int:
        """Number of measured samples of each output."""
        return int(self.mask.sum())

    @property
    def usual_length(self) -> float:
        """Geometric mean of the measured samples of the records."""
        return float(np.exp(np.mean(np.log(np.maximum(self.mask.sum(axis=1), 1)))))


def sizes_of(signals: Float[np.ndarray, "N n"]) -> Float[np.ndarray, " n"]:
    """Measure the spread of each signal, or a part of its largest value where that is more; 1 where all is zero.

    No signal at all, where every reading of a short record is an outlier, has 1 too.
    """
    if not len(signals):
        return np.ones(signals.shape[1])
    sizes = np.maximum(np.std(signals, axis=0), OFFSET * np.max(np.abs(signals), axis=0))
    return np.where(sizes > 0, sizes, 1.0)


def excerpts(experiments: Sequence[Experiment], samples: int = SEARCH_SAMPLES) -> list[Experiment]:
    """Cut pieces, evenly spread, out of experiments that are longer than a search needs; else return all of them."""
    total = sum(map(len, experiments))
    if total <= 1.5 * samples:
        return list(experiments)
    pieces = pieces_of(experiments)
    wanted = max(2, samples * len(pieces) // sum(map(len, pieces)))
    return [pieces[i] for i in np.unique(np.linspace(0, len(pieces) - 1, wanted).round().astype(int))]


def pieces_of(experiments: Sequence[Experiment]) -> list[Experiment]:
    """Cut experiments into pieces of one length; what is left over at the end is a piece where it is half as long."""
    return [x[a : a + PIECE] for x in experiments for a in range(0, max(1, len(x) - PIECE // 2), PIECE)]


def is_cut(chosen: Sequence[Experiment], experiments: Sequence[Experiment]) -> bool:
    """Tell whether what was chosen of these experiments are pieces of them."""
    return len(chosen) > len(experiments) or max(map(len, chosen)) < max(map(len, experiments))


def quantisation_step(y: Float[np.ndarray, "E T"]) -> float:
    """Find the step of the grid that all readings lie on; 0 when they do not, or when it is too fine to matter."""
    values = np.unique(y)
    if len(values) < 3:
        return 0.0
    steps = np.diff(values)
    step = float(np.min(steps[steps > 1e-9 * np.ptp(values)], initial=np.inf))
    if not np.isfinite(step) or step < 1e-3 * np.std(y):
        return 0.0
    whole = values / step
    # A digital reading is a multiple of its step; rounding in a file leaves a little.
    return step if np.mean(np.abs(whole - np.round(whole)) < 0.02) > ON_GRID else 0.0
