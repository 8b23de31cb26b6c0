"""The records that every part of simgap speaks in: rows are samples, units are physical."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from simgap.known_plant import KnownPlant

Kind = Literal["position", "velocity", "level", "other"]
KindFrom = Literal["written", "header", "option", "evidence", "unknown"]
Status = Literal["ok", "diverged", "error", "timeout"]

# No measurement is larger; squares and sums of squares of such values still fit into float64.
LARGEST_VALUE = 1e100
LONGEST_NAME = 80  # of a data set, in characters

LONGEST_PAST = 500  # samples: of the inputs before a record that was cut out of a run; no effect remembers many more

# Relative difference of two sampling times that is the jitter of one clock: each is read off time stamps of a record.
CLOCK_JITTER = 1e-4


class UnusableInput(ValueError):
    """What the user gave cannot be used; the message is one sentence that says where and what to do."""

    def __init__(self, sentence: str) -> None:
        super().__init__(" ".join(sentence.split()))  # what it quotes may hold line breaks


@dataclass(frozen=True)
class Channel:
    """One column of `u` or `y`: its name, its physical unit and what kind of motion it is.

    `kind_from` says who knows the kind: somebody wrote it (also in Python), its name and unit told it, an option
    did, the records showed it, or nobody knows. A kind that is left out is "other" and unknown. Channels are equal
    whoever knows their kind.
    """

    name: str
    unit: str = ""
    kind: Kind = None  # type: ignore[assignment]  # filled in below when nobody gave it
    kind_from: KindFrom = field(default=None, compare=False)  # type: ignore[assignment]

    def __post_init__(self) -> None:
        if self.kind_from is None:
            object.__setattr__(self, "kind_from", "unknown" if self.kind is None else "written")
        if self.kind is None:
            object.__setattr__(self, "kind", "other")


@dataclass(frozen=True)
class Channels:
    """The columns of `u` and of `y`, in order, and what is known of the machine between them."""

    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]
    plant: KnownPlant | None = field(default=None, compare=False)

    @classmethod
    def unnamed(cls, nu: int, ny: int) -> Channels:
        """Channels u0, u1, ... and y0, y1, ... for arrays that came without names."""
        return cls(tuple(Channel(f"u{i}") for i in range(nu)), tuple(Channel(f"y{i}") for i in range(ny)))


@dataclass(frozen=True, eq=False)
class Experiment:
    """One uninterrupted record: u [T, nu], y [T, ny], sampled every dt seconds.

    The arrays are float64, two-dimensional and read-only. `experiment[a:b]` is the record of those samples, which
    knows what came before them: for how long the machine had run, `since`, in seconds, and its last inputs, `before`
    [P, nu], the newest last; P is 0 where the run begins, and never above 500.
    Raises UnusableInput when the shapes do not fit, dt is not positive, or a value is not finite.
    """

    name: str
    u: Float[np.ndarray, "T nu"]
    y: Float[np.ndarray, "T ny"]
    dt: float
    since: float = 0.0
    before: Float[np.ndarray, "P nu"] = None  # type: ignore[assignment]  # filled in below for a whole run

    def __post_init__(self) -> None:
        if self.before is None:
            object.__setattr__(self, "before", np.asarray(self.u)[:0].copy())
        for column, shape in (("u", "[T, nu]"), ("y", "[T, ny]"), ("before", "[P, nu]")):
            values = np.asarray(getattr(self, column), dtype=np.float64).view()
            if values.ndim != 2:
                raise UnusableInput(
                    f"{self.name}: {column} has {values.ndim} dimensions; give rows of samples, {shape}"
                )
            # The extremes of an array with a NaN are NaN, and need no copy of a long record.
            if values.size and not (values.min() >= -LARGEST_VALUE and values.max() <= LARGEST_VALUE):
                row, channel = np.argwhere(~(np.abs(values) <= LARGEST_VALUE))[0]
                raise UnusableInput(
                    f"{self.name}: {column}[{row}, {channel}] is {values[row, channel]}, which is no measurement; "
                    f"correct it or end the record at the row before"
                )
            values.flags.writeable = False
            object.__setattr__(self, column, values)
        if len(self.u) != len(self.y):
            raise UnusableInput(
                f"{self.name}: u has {len(self.u)} samples and y has {len(self.y)}; cut them to the same length"
            )
        if self.before.shape[1] != self.u.shape[1]:
            raise UnusableInput(f"{self.name}: {self.before.shape[1]} inputs before it and {self.u.shape[1]} in it")
        object.__setattr__(self, "dt", float(self.dt))
        if not (0 < self.dt < np.inf):
            raise UnusableInput(f"{self.name}: the sampling time is {self.dt} s; it must be positive")

    def __len__(self) -> int:
        return len(self.y)

    def __reduce__(self) -> tuple[type[Experiment], tuple[Any, ...]]:
        """Arrays come out of a pickle writable; made anew, they are not."""
        return type(self), (self.name, self.u, self.y, self.dt, self.since, self.before)

    def __getitem__(self, samples: slice) -> Experiment:
        if not isinstance(samples, slice) or samples.step not in (None, 1):
            raise TypeError("an experiment is cut with a plain slice such as experiment[100:200]")
        first = samples.indices(len(self))[0]
        before = np.concatenate((self.before, self.u[max(0, first - LONGEST_PAST) : first]))[-LONGEST_PAST:]
        return Experiment(self.name, self.u[samples], self.y[samples], self.dt, self.since + self.dt * first, before)


@dataclass(frozen=True, eq=False)
class TrainingSet:
    """All that `fit` ever sees: experiments to train on, experiments to validate on, and n_init.

    n_init is the number of measured output samples that a simulation may use to find its state.
    There is no test field, so test data cannot leak into a model.
    """

    train: tuple[Experiment, ...]
    valid: tuple[Experiment, ...]
    n_init: int
    channels: Channels = None  # type: ignore[assignment]  # filled in below when the data came without names

    def __post_init__(self) -> None:
        object.__setattr__(self, "train", tuple(self.train))
        object.__setattr__(self, "valid", tuple(self.valid))
        if not self.train:
            raise UnusableInput("the training split is empty; give at least one training experiment")
        first = self.train[0]
        if self.channels is None:
            object.__setattr__(self, "channels", Channels.unnamed(first.u.shape[1], first.y.shape[1]))
        _check_alike(self.train + self.valid, self.channels)
        if self.n_init < 1:
            raise UnusableInput(f"n_init is {self.n_init}; a simulation needs at least one measured sample to start")

    @property
    def dt(self) -> float:
        """Sampling time in seconds."""
        return self.train[0].dt

    @property
    def held_out(self) -> tuple[Experiment, ...]:
        """What a model may choose on: the validation records longer than n_init, or else those of training."""
        return self.without_mere_starts().valid or tuple(x for x in self.train if len(x) > self.n_init)

    def without_mere_starts(self) -> TrainingSet:
        """Return the same without validation records of n_init samples or fewer, which can judge nothing."""
        return replace(self, valid=tuple(x for x in self.valid if len(x) > self.n_init))

    def as_runs(self) -> TrainingSet:
        """Return the same records as if each were a run of its own, for models that are not told what came before."""
        train, valid = (
            tuple(Experiment(x.name, x.u, x.y, x.dt) for x in records) for records in (self.train, self.valid)
        )
        return replace(self, train=train, valid=valid)


@dataclass(frozen=True, eq=False)
class Dataset:
    """A named data set: what a model may learn from, and the test experiments it is scored on."""

    name: str
    training: TrainingSet
    test: tuple[Experiment, ...]
    n_init: int
    channels: Channels
    sha256: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "test", tuple(self.test))
        # The name becomes a path and a page title, so it may hold nothing that means something there.
        if len(self.name) > LONGEST_NAME or not re.fullmatch(r"[^\W_][\w.\- ]*", self.name):
            raise UnusableInput(f"the data set name {self.name!r} is not usable; use letters, digits, '_', '-', '.', "
                                f"at most {LONGEST_NAME}")  # fmt: skip
        if not self.test:
            raise UnusableInput(f"{self.name}: the test split is empty; give at least one test experiment")
        _check_alike(self.training.train + self.test, self.channels)
        if self.n_init != self.training.n_init:
            raise UnusableInput(f"{self.name}: n_init differs between training and test")
        for experiment in self.test:
            if len(experiment) <= self.n_init:
                raise UnusableInput(
                    f"{self.name}: test experiment {experiment.name} has {len(experiment)} samples, "
                    f"of which n_init = {self.n_init} start the simulation; nothing is left to score"
                )
        if not self.sha256:
            object.__setattr__(self, "sha256", self._digest())

    def with_channels(self, channels: Channels) -> Dataset:
        """Return the same samples with other words about their columns."""
        return replace(self, training=replace(self.training, channels=channels), channels=channels)

    def _digest(self) -> str:
        digest = hashlib.sha256()
        training = self.training
        for split in (training.train, training.valid, self.test):
            digest.update(f"{len(split)} {self.n_init}".encode())
            for experiment in split:
                digest.update(f"{experiment.u.shape} {experiment.y.shape} {experiment.dt!r}".encode())
                digest.update(np.ascontiguousarray(experiment.u).tobytes())
                digest.update(np.ascontiguousarray(experiment.y).tobytes())
        return digest.hexdigest()


def same_sampling_time(one: float, other: float) -> bool:
    """Whether two sampling times in seconds are the same but for the jitter of a clock."""
    return abs(one - other) <= CLOCK_JITTER * max(one, other)


def _check_alike(experiments: tuple[Experiment, ...], channels: Channels) -> None:
    nu, ny, dt = len(channels.inputs), len(channels.outputs), experiments[0].dt
    if nu < 1 or ny < 1:
        raise UnusableInput("a data set needs at least one input and one output")
    for experiment in experiments:
        if experiment.u.shape[1] != nu or experiment.y.shape[1] != ny:
            raise UnusableInput(
                f"{experiment.name}: {experiment.u.shape[1]} inputs and {experiment.y.shape[1]} outputs, "
                f"where {nu} and {ny} are declared; every experiment needs the same columns"
            )
        if not same_sampling_time(experiment.dt, dt):
            raise UnusableInput(
                f"{experiment.name}: sampled every {experiment.dt} s, the first experiment every {dt} s; "
                f"resample them to one sampling time first"
            )


@dataclass(frozen=True)
class Result:
    """One line of the store: one model, simulated on one experiment of one data set, for one task and seed.

    `metrics` maps each output's name to its figures, in physical units. `message` says why when the status is
    not ok, and carries warnings of the fit when it is. `fitted` is what the fit chose, such as an order; `valid_nrmse`
    the error of the free run on the validation data, before the model was estimated on them too, over their spread.
    """

    model: str
    params: dict[str, Any]
    dataset: str
    experiment: str
    task: str
    seed: int
    status: Status
    metrics: dict[str, dict[str, Any]] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    fitted: dict[str, Any] = field(default_factory=dict)
    n_params: int | None = None
    fit_seconds: float | None = None
    simulate_seconds: float | None = None
    message: str = ""
    provenance: dict[str, Any] = field(default_factory=dict)
    schema: int = 1
    valid_nrmse: float | None = None
