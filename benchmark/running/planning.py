"""What a run has to do: the jobs that a suite, the user's choices and the stored results leave open."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from simgap.records import Result, UnusableInput
from simgap.registry import DATASETS
from simgap.results import store
from simgap.results.store import plain
from simgap.running.fitting import check_params
from simgap.running.jobs import SLOW_IMPORTS, Card, Job, LoadArguments, model_code
from simgap.running.source import Code
from simgap.running.suites import Entry, Suite

Message = Callable[[str], None]


@dataclass(frozen=True)
class Choice:
    """What the user named in place of a suite's: models, files of models (`file.py:Class`), data sets."""

    models: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    load_arguments: tuple[LoadArguments, ...] = ()


def choose_entries(suite: Suite, choice: Choice, message: Message) -> list[Entry]:
    """List the models to run: those that the user named, or else the suite's.

    A name may be a label of the suite. One of the suite's that cannot be imported is left out with a message; one
    that the user named raises UnusableInput.
    """
    by_label = {entry.label: entry for entry in suite.models}
    named = [by_label.get(name, Entry(name)) for name in choice.models] + [Entry(name) for name in choice.files]
    entries = []
    for entry in named or suite.models:
        try:
            check_params(entry.name, entry.params)
        except UnusableInput as error:
            if named:
                raise
            message(f"left out: {error}")
        else:
            entries.append(entry)
    keys = [(entry.label, str(plain(entry.params))) for entry in entries]
    if twice := [label for label, params in keys if keys.count((label, params)) > 1]:
        raise UnusableInput(f"two models are called {twice[0]}; give one of them another name")
    if not entries:
        raise UnusableInput(f"none of the models of suite {suite.name} can be imported; name one with --models")
    return entries


def load_arguments(
    datasets: Sequence[str], inputs: Sequence[str], outputs: Sequence[str], dt: float | None,
    resample: float | None = None, split_gaps: bool = False,
) -> list[LoadArguments]:  # fmt: skip
    """How to load the named data sets. Columns and times go to the CSV files among them, if there are."""
    files = [name for name in datasets if Path(name).is_file()]
    of_file = LoadArguments("", tuple(inputs), tuple(outputs), dt, resample, split_gaps)
    return [replace(of_file, data=name) if name in files or not files else LoadArguments(name) for name in datasets]


def choose_data(suite: Suite, named: Sequence[LoadArguments], message: Message) -> list[tuple[LoadArguments, Card]]:
    """Load the data sets to run on and keep their cards: those the user named, or else the suite's.

    One of the suite's that is not at hand is left out with a message; one the user named raises UnusableInput.
    """
    chosen = []
    for arguments in named or [LoadArguments(name) for name in suite.datasets]:
        try:
            chosen.append((arguments, Card.of(arguments.load())))
        except UnusableInput as error:
            if named or arguments.data not in DATASETS:
                raise
            message(f"left out: {error}")
    names = [card.name for _, card in chosen]
    if twice := [name for name in names if names.count(name) > 1]:
        raise UnusableInput(f"two data sets are called {twice[0]}; give one of them another name")
    if not chosen:
        raise UnusableInput(f"none of the data sets of suite {suite.name} is at hand; name one with --datasets")
    return chosen


def plan(
    suite: Suite, entries: Sequence[Entry], data: Sequence[tuple[LoadArguments, Card]], provenance: dict[str, Any]
) -> list[Job]:
    """List all jobs, one data set after the other.

    Each carries a digest of its model's code: results of the old code must not stand for the new.
    """
    codes = [model_code(entry) for entry in entries]
    return [
        Job(
            entry, arguments, card, seed, suite.tasks, provenance | {"model_sha256": code.sha256()}, _slow_imports(code)
        )
        for arguments, card in data
        for seed in range(suite.seeds)
        for entry, code in zip(entries, codes, strict=True)
    ]


def _slow_imports(code: Code) -> tuple[str, ...]:
    return tuple(module for package in sorted(code.outside) for module in SLOW_IMPORTS.get(package, ()))


def stored_rows(jobs: Sequence[Job], folder: Path, suite: Suite) -> dict[store.Key, Result]:
    """Read the stored results of these jobs' models that need not be computed again, by key."""
    rows = {}
    for label in {job.entry.label for job in jobs}:
        path = store.path_of(folder, suite.name, label)
        rows |= {store.key(row): row for row in (store.read(path) if path.exists() else ())}
    return {key: row for key, row in rows.items() if row.status in ("ok", "diverged")}


def done_already(job: Job, rows: dict[store.Key, Result]) -> list[Result]:
    """Return the job's results if all are stored and came from the same data and code of the model, else none."""
    stored = [rows.get(store.key(owed)) for owed in job.owed()]
    wanted = {name: job.about.provenance.get(name) for name in ("data_sha256", "model_sha256")}
    for row in stored:
        if row is None or any(row.provenance.get(name) != digest for name, digest in wanted.items()):
            return []
    return [row for row in stored if row is not None]


def with_seeds(suite: Suite, seeds: int | None) -> Suite:
    """The suite with the number of seeds the user asked for. Raises UnusableInput."""
    if seeds is None:
        return suite
    if seeds < 1:
        raise UnusableInput(f"--seeds {seeds}: give at least one seed")
    return replace(suite, seeds=seeds)
