"""Work on this machine, each piece in a process of its own that ends with it."""

from __future__ import annotations

import contextlib
import signal
import sys
import tempfile
import types
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, replace
from multiprocessing.context import BaseContext, ForkServerContext, SpawnContext
from multiprocessing.synchronize import RLock
from typing import Any

from pebble import CONSTS, ProcessExpired, ProcessPool

from simgap.protocol import listen
from simgap.registry import ENGINES
from simgap.running.engines.engine import Event, Running, Work, note_progress, noted_share, shared_folder
from simgap.running.workers import Limits, prepare_worker, threads_per_worker

# Imported once, by the process from which those of the jobs are forked. The models themselves are not: they may have
# changed since, and a job imports them in milliseconds.
PRELOADED = (
    "simgap.running.engines.preloading",
    "simgap.running.jobs",
    "scipy.signal",
    "scipy.optimize",
    "scipy.stats",
)

# Seconds between two looks of the pool at its processes, of which every job needs a new one.
CONSTS.sleep_unit = 0.02


@ENGINES.register("local")
@dataclass(frozen=True)
class Local:
    """This machine: at most `workers` pieces of work at a time, each in a process of its own."""

    workers: int
    limits: Limits

    @staticmethod
    def threads(workers: int) -> int:
        """Each worker's share of the machine."""
        return threads_per_worker(workers)

    def __call__(self, todo: Sequence[Work]) -> Generator[Event, None, None]:
        """Rows and what is under way; see Engine."""
        if not todo:
            return
        with _main_left_alone(), contextlib.ExitStack() as stack:
            notes = stack.enter_context(tempfile.TemporaryDirectory(prefix="simgap", ignore_cleanup_errors=True))
            limits = replace(self.limits, environment=self.limits.environment | {"SIMGAP_RUN": notes})
            context = _context(todo)  # lives until its processes have ended
            pool = ProcessPool(min(self.workers, len(todo)), max_tasks=1, initializer=prepare_worker,
                               initargs=(limits,), context=context)  # fmt: skip
            stack.callback(pool.join)
            stack.callback(pool.stop)  # runs before join, and after Ctrl-C too
            pending: dict[Future, Work] = {
                pool.schedule(_execute, (work,), timeout=limits.timeout): work for work in todo
            }
            while pending:
                ended, _ = wait(pending, timeout=0.3, return_when=FIRST_COMPLETED)
                for future in ended:
                    yield _rows_of(future, pending.pop(future), limits)
                yield tuple(
                    Running(work, noted_share(notes, work)) for future, work in pending.items() if future.running()
                )


def _execute(work: Work) -> list[Any]:
    """Runs in the process of the work."""
    if (folder := shared_folder()) is not None:
        listen(lambda done, total: note_progress(folder, work, done, total))
    return work.execute()


def _context(todo: Sequence[Work]) -> BaseContext:
    """Forked from a process that has imported what the work needs, but has done nothing yet; else started anew."""
    if sys.platform != "linux":
        return _Spawn()
    context = _ForkServer()
    context.set_forkserver_preload(list(dict.fromkeys([*PRELOADED, *(name for work in todo for name in work.preload)])))
    return context


class _KeptLocks(BaseContext):
    """Keeps the locks that it makes for as long as it lives.

    A process opens them by name while it starts. The pool drops its own, and with them the names, before it stops the
    processes that it has just started for work that never came: these would print a FileNotFoundError.
    """

    def __init__(self) -> None:
        self._locks: list[RLock] = []

    def RLock(self) -> RLock:
        """A lock that is kept."""
        self._locks.append(super().RLock())
        return self._locks[-1]


class _ForkServer(_KeptLocks, ForkServerContext):
    """Processes forked from one that has done nothing yet."""


class _Spawn(_KeptLocks, SpawnContext):
    """Processes started anew."""


def _rows_of(future: Future, work: Work, limits: Limits) -> list[Any]:
    """The rows of work that has ended, however it ended."""
    match future.exception():
        case None:
            return future.result()
        case TimeoutError():
            text = f"no result after {limits.timeout:g} s; raise the suite's timeout or give the model less to do"
            return work.failed("timeout", text)
        case ProcessExpired() as error:
            return work.failed("error", f"the worker process {_how_it_ended(error.exitcode)}")
        case error:
            return work.failed("error", f"the worker failed: {type(error).__name__}: {error}")


def _how_it_ended(exitcode: int | None) -> str:
    if exitcode is not None and exitcode < 0:
        with contextlib.suppress(ValueError):
            name = signal.Signals(-exitcode).name
            return f"was ended by {name}: a crash in compiled code, or the system had no memory left"
    by_whom = "the process that starts workers was killed" if exitcode == 255 else "an exit by the model itself"
    return f"ended with exit code {exitcode}: {by_whom}"


@contextlib.contextmanager
def _main_left_alone() -> Iterator[None]:
    """Keep workers from importing the caller's script again.

    A script that calls `simgap.run` without an `if __name__ == "__main__"` would start a run within the run.
    """
    main = sys.modules["__main__"]
    sys.modules["__main__"] = types.ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main
