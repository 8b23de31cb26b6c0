"""Jobs: one model, its parameters, one data set and one seed, executed in a worker process."""

from __future__ import annotations

import contextlib
import hashlib
import inspect
import os
import pickle
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from simgap.metrics import failed_metrics
from simgap.protocol import listen
from simgap.records import Channels, Dataset, Result, Status
from simgap.registry import MODELS
from simgap.results.store import plain
from simgap.running.fitting import build, fit_model, model_class, reason, score_model
from simgap.running.source import Code, code_of
from simgap.running.suites import Entry
from simgap.tasks import TASKS

# What takes seconds to import, by the package that a model's code imports. torch._dynamo is what the first step of an
# optimiser imports.
SLOW_IMPORTS = {"torch": ("torch", "torch._dynamo", "safetensors.torch")}


@dataclass(frozen=True)
class Source:
    """Where a data set comes from: the arguments of `simgap.load`."""

    data: str
    inputs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    dt: float | None = None

    def load(self) -> Dataset:
        """Raises UnusableInput."""
        from simgap.data import load

        return load(self.data, inputs=self.inputs, outputs=self.outputs, dt=self.dt)


@dataclass(frozen=True)
class Card:
    """What the parent keeps of a data set, to know which results a job owes."""

    name: str
    experiments: tuple[str, ...]
    channels: Channels
    sha256: str

    @classmethod
    def of(cls, dataset: Dataset) -> Card:
        """The card of a loaded data set."""
        return cls(dataset.name, tuple(e.name for e in dataset.test), dataset.channels, dataset.sha256)


@dataclass(frozen=True)
class Job:
    """One fit with all its simulations; `preload` are modules that are imported once for all jobs."""

    entry: Entry
    source: Source
    card: Card
    seed: int
    tasks: tuple[str, ...]
    provenance: dict[str, Any] = field(default_factory=dict)
    preload: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.entry.label} on {self.card.name}, seed {self.seed}"

    @property
    def about(self) -> Result:
        """What all results of this job have in common."""
        return Result(
            model=self.entry.label, params=plain(self.entry.params), dataset=self.card.name, experiment="",
            task="", seed=self.seed, status="ok",
            provenance=self.provenance | {"data_sha256": self.card.sha256},
            units={channel.name: channel.unit for channel in self.card.channels.outputs},
        )  # fmt: skip

    def owed(self) -> Iterator[Result]:
        """The results this job owes, without their figures: one per test experiment and task."""
        for experiment in self.card.experiments:
            for task in self.tasks:
                yield replace(self.about, experiment=experiment, task=task)

    def failed(self, status: Status, message: str) -> list[Result]:
        """All results of this job, saying that and why there are none."""
        metrics = failed_metrics(self.card.channels)
        return [replace(row, status=status, message=message, metrics=metrics) for row in self.owed()]


def execute(job: Job) -> list[Result]:
    """Fit and score. Whatever the model does short of ending the process becomes rows."""
    try:
        dataset = _load(job)
    except Exception as error:  # the file may have changed since the parent read it
        return job.failed("error", f"the data set could not be loaded again: {error}")
    if dataset.sha256 != job.card.sha256:
        return job.failed("error", "the data set changed while the run was under way; run again")
    try:
        listen(_note_of(job))
        model = build(job.entry.name, job.entry.params)
        about = fit_model(model, dataset.training, job.about)
    except BaseException as error:  # a model may raise anything, and Ctrl-C is not heard in a worker
        return job.failed("error", reason("fit", error))
    try:
        return score_model(model, dataset, [TASKS[name]() for name in job.tasks], about)
    except BaseException as error:
        return job.failed("error", reason("simulate", error))


def _load(job: Job) -> Dataset:
    """The job's data, which may take seconds to make: the first job of a run leaves them for the others."""
    folder = os.environ.get("SIMGAP_RUN")
    if folder is None:
        return job.source.load()
    file = Path(folder) / f"{job.card.sha256}.data"
    if not file.exists():
        dataset = job.source.load()
        partial = file.with_suffix(f".{os.getpid()}")
        with contextlib.suppress(OSError):  # a full disk must not end a fit
            partial.write_bytes(pickle.dumps(dataset))
            partial.replace(file)
        return dataset
    return pickle.loads(file.read_bytes())  # from the run's own folder, which nobody else may write


def model_code(entry: Entry) -> Code:
    """The code of the model, and of the others that its parameters name, if they do. Raises UnusableInput."""
    kind = model_class(entry.name)
    arguments = inspect.signature(kind).bind(**entry.params)
    arguments.apply_defaults()
    others = [text for text in _texts(arguments.arguments) if text in MODELS]
    return code_of([kind, *map(model_class, others)])


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for inner in value.values():
            yield from _texts(inner)


def progress_file(folder: str | Path, job: Job) -> Path:
    """Where a worker notes how far a job is."""
    return Path(folder) / hashlib.sha256(repr((str(job), job.entry)).encode()).hexdigest()[:24]


def _note_of(job: Job) -> Callable[[int, int], None] | None:
    folder = os.environ.get("SIMGAP_RUN")
    return None if folder is None else lambda done, total: _note(progress_file(folder, job), done, total)


def _note(file: Path, done: int, total: int) -> None:
    with contextlib.suppress(OSError):  # a full disk must not end a fit
        file.write_text(f"{done} {total}", encoding="ascii")
