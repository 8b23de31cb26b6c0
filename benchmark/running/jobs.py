"""Jobs: one model, its parameters, one data set and one seed, executed in a worker process."""

from __future__ import annotations

import contextlib
import inspect
import os
import pickle
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from simgap.metrics import failed_metrics
from simgap.protocol import Model, is_stochastic
from simgap.records import Channels, Dataset, Result, Status
from simgap.registry import MODELS, file_of
from simgap.results import artefacts
from simgap.results.artefacts import Artefact
from simgap.results.store import plain
from simgap.running.engines.engine import shared_folder
from simgap.running.fitting import build, fit_model, model_class, reason, score_model
from simgap.running.rounding import in_other_units
from simgap.running.source import Code, code_of
from simgap.running.suites import Entry
from simgap.running.workers import checkpoints_of
from simgap.tasks import TASKS

# What takes seconds to import, by the package that a model's code imports. torch._dynamo is what the first step of an
# optimiser imports.
SLOW_IMPORTS = {"torch": ("torch", "torch._dynamo", "safetensors.torch")}


@dataclass(frozen=True)
class LoadArguments:
    """How to load a data set: the arguments of `simgap.load`."""

    data: str
    inputs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    dt: float | None = None
    resample: float | None = None
    split_gaps: bool = False

    def load(self) -> Dataset:
        """Raises UnusableInput."""
        from simgap.data import load

        return load(**self.source)

    @property
    def source(self) -> dict[str, Any]:
        """The same by the names that `simgap.load` gives them."""
        return {"source": self.data} | {name: value for name, value in vars(self).items() if name != "data"}


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
    """One fit with all its simulations; `preload` are modules that are imported once for all jobs.

    `artefact` is the file that takes its free runs; without one they are not kept.
    """

    entry: Entry
    arguments: LoadArguments
    card: Card
    seed: int
    tasks: tuple[str, ...]
    provenance: dict[str, Any] = field(default_factory=dict)
    preload: tuple[str, ...] = ()
    artefact: Path | None = None

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

    @property
    def gpus(self) -> float:
        """What a cluster sets apart for it."""
        return self.entry.gpus

    def failed(self, status: Status, message: str) -> list[Result]:
        """All results of this job, saying that and why there are none."""
        metrics = failed_metrics(self.card.channels)
        return [replace(row, status=status, message=message, metrics=metrics) for row in self.owed()]

    def execute(self) -> list[Result]:
        """Fit and score. Whatever the model does short of ending the process becomes rows."""
        try:
            dataset = _load(self.arguments, self.card)
        except Exception as error:  # the file may have changed since the parent read it
            return self.failed("error", f"the data set could not be loaded again: {error}")
        if dataset.sha256 != self.card.sha256:
            return self.failed("error", "the data set changed while the run was under way; run again")
        try:
            model = build(self.entry.name, self.entry.params)
            # A model without randomness has seeds too: they show how much rounding moves it.
            training = dataset.training if is_stochastic(model) else in_other_units(dataset.training, self.seed)
            with checkpoints_of(self.provenance["model_sha256"]):
                about = fit_model(model, training, self.about)
        except BaseException as error:  # a model may raise anything, and Ctrl-C is not heard in a worker
            return self.failed("error", reason("fit", error))
        try:
            results, runs = score_model(model, dataset, [TASKS[name]() for name in self.tasks], about)
        except BaseException as error:
            return self.failed("error", reason("simulate", error))
        self._leave_artefact(model, dataset, runs)
        return results

    def _leave_artefact(self, model: Model, dataset: Dataset, runs: dict[str, np.ndarray]) -> None:
        if self.artefact is None or not runs:
            return
        with contextlib.suppress(Exception):  # neither a full disk nor a model's own attributes must cost the figures
            polynomial = getattr(model, "polynomial", None)
            about = self.about.provenance
            source = self.arguments.source | {"source": _absolute(self.arguments.data)}
            artefacts.write(self.artefact, Artefact(
                runs, dataset.n_init, dataset.training.dt, about.get("model_sha256", ""), self.card.sha256,
                () if polynomial is None else polynomial.state_space, source,
            ))  # fmt: skip

    def portable(self) -> Job:
        """The same job with absolute paths."""
        entry, file = self.entry, file_of(self.entry.name)
        if file:
            entry = replace(entry, name=f"{Path(file).absolute()}{entry.name.removeprefix(file)}")
        arguments = replace(self.arguments, data=_absolute(self.arguments.data))
        artefact = None if self.artefact is None else self.artefact.absolute()
        return replace(self, entry=entry, arguments=arguments, artefact=artefact)

    def has_its_code(self) -> bool:
        """Whether the model's code is that of the digest."""
        return model_code(self.entry).sha256() == self.provenance["model_sha256"]


def _load(arguments: LoadArguments, card: Card) -> Dataset:
    """The data, which may take seconds to make: the first job of a run leaves them for the others."""
    folder = shared_folder()
    if folder is None:
        return arguments.load()
    file = Path(folder) / f"{card.name}-{card.sha256}.data"  # the same samples may have another name, or other units
    if not file.exists():
        dataset = arguments.load()
        partial = file.with_suffix(f".{os.getpid()}")
        with contextlib.suppress(OSError):  # a full disk must not end a fit
            partial.write_bytes(pickle.dumps(dataset))
            partial.replace(file)
        return dataset
    return pickle.loads(file.read_bytes())  # from the run's own folder, which nobody else may write


def _absolute(data: str) -> str:
    """The absolute path of a file or folder; a registered name stays."""
    return str(Path(data).absolute()) if Path(data).exists() else data


def model_code(entry: Entry) -> Code:
    """The code of the model, and of the others that its parameters name, if they do. Raises UnusableInput."""
    kind = model_class(entry.name)
    params = inspect.signature(kind).bind(**entry.params)
    params.apply_defaults()
    others = [text for text in _texts(params.arguments) if text in MODELS]
    return code_of([kind, *map(model_class, others)])


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for inner in value.values():
            yield from _texts(inner)
