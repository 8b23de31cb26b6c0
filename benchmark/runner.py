"""Run a suite: every job in a worker process, every result into the store as soon as it is there."""

from __future__ import annotations

import contextlib
import logging
import multiprocessing
import sys
import tempfile
import types
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from pathlib import Path

from pebble import ProcessExpired, ProcessPool

from simgap import planning, store
from simgap.jobs import Job, execute, progress_file
from simgap.provenance import provenance
from simgap.records import Result, UnusableInput
from simgap.suites import load_suite
from simgap.workers import prepare_worker, threads_per_worker


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
    out: str | Path = "results",
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    dt: float | None = None,
    progress: Listener | None = None,
) -> list[Result]:
    """Run a suite and return its results, those of an earlier run into the same folder included.

    `models` are registered names or labels of the suite, `model` are `file.py:Class`; either replaces the
    suite's models, `datasets` (names or paths) its data sets. `inputs`, `outputs` and `dt` [s] tell how to
    read CSV files. What is stored for the same data is not computed again. Raises UnusableInput.
    """
    if engine != "local":
        raise UnusableInput(f"the engine {engine!r} is not available; the only one is 'local'")
    if jobs < 1:
        raise UnusableInput(f"--jobs {jobs}: give at least one worker")
    tell = progress or _log_notes
    chosen = planning.with_seeds(load_suite(suite), seeds)

    def note(text: str) -> None:
        tell(Progress(note=text))

    entries = planning.choose_entries(chosen, _listed(models), _listed(model), note)
    sources = planning.sources(_listed(datasets), _listed(inputs), _listed(outputs), dt)
    data = planning.choose_data(chosen, sources, note)
    threads = threads_per_worker(jobs)
    planned = planning.plan(chosen, entries, data, provenance(threads))

    known = planning.stored_rows(planned, Path(out), chosen)
    stored = [planning.done_already(job, known) for job in planned]
    todo = [job for job, rows in zip(planned, stored, strict=True) if not rows]
    if len(todo) < len(planned):
        note(f"{len(planned) - len(todo)} of {len(planned)} jobs are done already and were not run again")
    results = [row for rows in stored for row in rows]
    # What an interrupted fit left to carry on from; gone with the fit.
    folders = {"SIMGAP_CHECKPOINTS": str(Path(out).absolute() / ".checkpoints")}
    workers = min(jobs, len(todo))
    with contextlib.closing(_execute_all(todo, workers, threads, chosen.timeout, folders, tell)) as outcomes:
        for rows in outcomes:
            store.append(Path(out), chosen.name, rows)
            results += rows
    return results


def _execute_all(
    todo: Sequence[Job], workers: int, threads: int, timeout: float, folders: dict[str, str], tell: Listener
) -> Generator[list[Result], None, None]:
    """The results of each job, in the order in which they end."""
    if not todo:
        return
    with _main_left_alone(), contextlib.ExitStack() as stack:
        notes = stack.enter_context(tempfile.TemporaryDirectory(prefix="simgap"))
        context = multiprocessing.get_context("spawn")
        given = (threads, folders | {"SIMGAP_PROGRESS": notes})
        pool = ProcessPool(workers, initializer=prepare_worker, initargs=given, context=context)
        stack.callback(pool.join)
        stack.callback(pool.stop)  # runs before join, and after Ctrl-C too
        pending: dict[Future, Job] = {pool.schedule(execute, (job,), timeout=timeout): job for job in todo}
        while pending:
            ended, _ = wait(pending, timeout=0.3, return_when=FIRST_COMPLETED)
            for future in ended:
                job = pending.pop(future)
                rows = _outcome(future, job, timeout)
                yield rows
                tell(Progress(len(todo) - len(pending), len(todo), finished=tuple(rows)))
            running = [(job, _share(progress_file(notes, job))) for future, job in pending.items() if future.running()]
            names = tuple(f"{job} ({share:.0%})" if share else str(job) for job, share in running)
            done = len(todo) - len(pending)
            tell(Progress(done, len(todo), names, share=(done + sum(share for _, share in running)) / len(todo)))


def _share(file: Path) -> float:
    """How far a worker says that its job is; zero if it says nothing."""
    try:
        done, total = map(int, file.read_text(encoding="ascii").split())
        return min(1.0, done / total)
    except (OSError, ValueError, ZeroDivisionError):
        return 0.0


def _outcome(future: Future, job: Job, timeout: float) -> list[Result]:
    """The rows of a job that has ended, however it ended."""
    match future.exception():
        case None:
            return future.result()
        case TimeoutError():
            text = f"no result after {timeout:g} s; raise the suite's timeout or give the model less to do"
            return job.failed("timeout", text)
        case ProcessExpired() as error:
            text = "a crash in compiled code, no memory left, or an exit by the model itself"
            return job.failed("error", f"the worker process ended with exit code {error.exitcode}: {text}")
        case error:
            return job.failed("error", f"the worker failed: {type(error).__name__}: {error}")


@contextlib.contextmanager
def _main_left_alone() -> Iterator[None]:
    """Keep workers from importing the caller's script again.

    A script that calls `simgap.run` without an `if __name__ == "__main__"` would start a run within the run,
    and what it imports (NumPy) would be there before the limit on threads.
    """
    main = sys.modules["__main__"]
    sys.modules["__main__"] = types.ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def _log_notes(progress: Progress) -> None:
    if progress.note:
        logging.getLogger("simgap").warning(progress.note)


def _listed(names: Sequence[str] | None) -> list[str]:
    return [names] if isinstance(names, str) else list(names or ())
