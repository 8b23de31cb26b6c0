"""Run a suite: every job in a process of its own, every result into the store as soon as it is there."""

from __future__ import annotations

import contextlib
import logging
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from simgap.records import Result, UnusableInput
from simgap.results import store
from simgap.running import planning
from simgap.running.engines.engine import Engine, Running
from simgap.running.engines.local import Local
from simgap.running.provenance import provenance
from simgap.running.suites import load_suite
from simgap.running.workers import Limits, threads_per_worker


@dataclass(frozen=True)
class Progress:
    """How far a run is. `finished` holds the results of the job that has just ended, if one has."""

    done: int = 0
    total: int = 0
    running: tuple[str, ...] = ()
    finished: tuple[Result, ...] = ()
    note: str = ""
    share: float = 0.0  # of all jobs, those under way counted as far as they say they are


Listener = Callable[[Progress], None]


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
) -> list[Result]:
    """Run a suite and return its results, those of an earlier run into the same folder included.

    `models` are registered names or labels of the suite, `model` are `file.py:Class`; either replaces the
    suite's models, `datasets` (names or paths) its data sets. `inputs`, `outputs` and `dt` [s] tell how to
    read CSV files. `jobs` is how many run at a time on this machine; with engine "ray" they go to the Ray cluster
    at `address` instead. What is stored for the same data is not computed again. Raises UnusableInput.
    """
    if jobs < 1:
        raise UnusableInput(f"--jobs {jobs}: give at least one worker")
    tell = progress or _log_notes
    chosen = planning.with_seeds(load_suite(suite), seeds)
    threads = threads_per_worker(jobs) if engine == "local" else 1
    # What an interrupted fit left to carry on from; gone with the fit.
    folders = {"SIMGAP_CHECKPOINTS": str(Path(out).absolute() / ".checkpoints")}
    execute = _engine(engine, jobs, address, Limits(threads, chosen.timeout, chosen.memory, folders))

    def note(text: str) -> None:
        tell(Progress(note=text))

    entries = planning.choose_entries(chosen, _listed(models), _listed(model), note)
    sources = planning.sources(_listed(datasets), _listed(inputs), _listed(outputs), dt)
    data = planning.choose_data(chosen, sources, note)
    planned = planning.plan(chosen, entries, data, provenance(threads))
    folder = store.writable(Path(out))

    known = planning.stored_rows(planned, folder, chosen)
    stored = [planning.done_already(job, known) for job in planned]
    todo = [job for job, rows in zip(planned, stored, strict=True) if not rows]
    if len(todo) < len(planned):
        note(f"{len(planned) - len(todo)} of {len(planned)} jobs are done already and were not run again")
    results = [row for rows in stored for row in rows]
    ended = 0
    with contextlib.closing(execute(todo)) as events:
        for event in events:
            if isinstance(event, list):
                store.append(folder, chosen.name, event)
                results += event
                ended += 1
                tell(Progress(ended, len(todo), finished=tuple(event)))
            else:
                tell(_under_way(ended, len(todo), event))
    for label in {job.entry.label for job in planned}:
        store.tidy(folder, chosen.name, label)
    return results


def _under_way(ended: int, total: int, running: tuple[Running, ...]) -> Progress:
    names = tuple(f"{at.job} ({at.share:.0%})" if at.share else str(at.job) for at in running)
    return Progress(ended, total, names, share=(ended + sum(at.share for at in running)) / total)


def _engine(name: str, jobs: int, address: str | None, limits: Limits) -> Engine:
    """Raises UnusableInput for one that cannot be used."""
    if name == "local":
        if address is not None:
            raise UnusableInput("--address is for --engine ray: the engine local needs none")
        return Local(jobs, limits)
    if name != "ray":
        raise UnusableInput(f"the engine {name!r} is not known; choose local or ray")
    from simgap.running.engines.ray import Cluster

    if not (address := address or os.environ.get("RAY_ADDRESS")):
        raise UnusableInput("--engine ray: say where the cluster is: --address HOST:PORT")
    return Cluster(limits, address)


def _log_notes(progress: Progress) -> None:
    if progress.note:
        logging.getLogger("simgap").warning(progress.note)


def _listed(names: Sequence[str] | None) -> list[str]:
    return [names] if isinstance(names, str) else list(names or ())
