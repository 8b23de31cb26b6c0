"""Run a suite: what is stored is taken from there, the rest is computed and stored job by job."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from simgap.records import Result
from simgap.results import artefacts, store
from simgap.running import planning
from simgap.running.execution import Execution, Listener, carry_out, log_messages
from simgap.running.jobs import Job
from simgap.running.planning import Choice
from simgap.running.provenance import provenance
from simgap.running.suites import Suite, load_suite


def run(
    suite: str = "full",
    models: Sequence[str] | None = None,
    model: Sequence[str] = (),
    datasets: Sequence[str] | None = None,
    seeds: int | None = None,
    jobs: int = 1,
    engine: str = "local",
    address: str | None = None,
    out: str | Path = "results",
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    dt: float | None = None,
    progress: Listener | None = None,
    resample: float | None = None,
    split_gaps: bool = False,
) -> list[Result]:
    """Run a suite and return its results, those of an earlier run into the same folder included.

    `models` are registered names or labels of the suite, `model` are `file.py:Class`; either replaces the
    suite's models, `datasets` (names or paths) its data sets. `inputs`, `outputs`, `dt` [s], `resample` [s] and
    `split_gaps` tell how to read CSV files, as for `simgap.load`. `jobs` is how many run at a time on this machine;
    `engine` is a registered one: "ray" hands them to the Ray cluster at `address` instead. What is stored for the same
    data and code is not computed again. Raises UnusableInput.
    """
    wanted = planning.with_seeds(load_suite(suite), seeds)
    reading = _listed(inputs), _listed(outputs), dt, resample, split_gaps
    named = _listed(datasets) or (wanted.datasets if any(reading) else ())
    choice = Choice(tuple(_listed(models)), tuple(_listed(model)), tuple(planning.load_arguments(named, *reading)))
    execution = Execution(engine, jobs, {"address": address}, Path(out), progress or log_messages)
    return run_suite(wanted, choice, execution)


def run_suite(suite: Suite, choice: Choice, execution: Execution) -> list[Result]:
    """Run those of a suite's jobs that the user chose and that are not stored. Raises UnusableInput."""
    engine = execution.start(suite.timeout, suite.memory)
    entries = planning.choose_entries(suite, choice, execution.send)
    data = planning.choose_data(suite, choice.load_arguments, execution.send)
    planned = planning.plan(suite, entries, data, provenance(execution.threads))
    folder = store.writable(execution.out)
    planned = [replace(job, artefact=artefacts.path_of(folder, suite.name, job.about)) for job in planned]
    results, todo = _split(planned, planning.stored_rows(planned, folder, suite))
    if len(todo) < len(planned):
        execution.send(f"{len(planned) - len(todo)} of {len(planned)} jobs are done already and were not run again")
    for rows in carry_out(engine, todo, lambda rows: store.append(folder, suite.name, rows), execution.listener):
        results += rows
    for label in {job.entry.label for job in planned}:
        store.tidy(folder, suite.name, label)
    return results


def _split(planned: Sequence[Job], known: dict[store.Key, Result]) -> tuple[list[Result], list[Job]]:
    """The stored results of those jobs that are done, and the jobs that are not."""
    results: list[Result] = []
    todo: list[Job] = []
    for job in planned:
        stored = planning.done_already(job, known)
        results += stored
        if not stored:
            todo.append(job)
    return results, todo


def _listed(names: Sequence[str] | None) -> list[str]:
    return [names] if isinstance(names, str) else list(names or ())
