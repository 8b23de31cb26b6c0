"""What a worker process does before it takes a job. This module imports no NumPy: see `limit_threads`."""

from __future__ import annotations

import contextlib
import ctypes
import multiprocessing
import os
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from simgap.cores import end_with_parent

_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
GIB = 1 << 30


@dataclass(frozen=True)
class Limits:
    """What one job may use: threads of the numerical libraries, seconds, and GiB of memory.

    environment: variables that name where a model may keep what it needs to carry on (SIMGAP_CHECKPOINTS), and the
    folder of the run, where jobs note how far they are and leave data for each other (SIMGAP_RUN).
    """

    threads: int
    timeout: float = 3600.0
    memory: float = 8.0
    environment: dict[str, str] = field(default_factory=dict)


def prepare_worker(limits: Limits) -> None:
    """Limit threads and memory of this process, discard what it prints, and end it when its parent ends."""
    limit_threads(limits.threads)
    limit_memory(limits.memory)
    reuse_memory()
    silence()
    os.environ.update(limits.environment)
    threading.Thread(target=end_with_parent, daemon=True).start()


@contextlib.contextmanager
def checkpoints_of(code: str) -> Iterator[None]:
    """Let a fit carry on only from what the same code, a digest, has left."""
    folder = os.environ.get("SIMGAP_CHECKPOINTS")
    if not folder:
        yield
        return
    own = Path(folder) / code[:12]
    os.environ["SIMGAP_CHECKPOINTS"] = str(own)
    try:
        yield
    finally:
        os.environ["SIMGAP_CHECKPOINTS"] = folder
        with contextlib.suppress(OSError):  # it holds what a killed fit left
            own.rmdir()


def threads_per_worker(workers: int) -> int:
    """Share the machine's cores out among the workers, at least one each."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, cores // workers)


def limit_threads(threads: int) -> None:
    """Set the limit of the numerical libraries, of those that will be loaded and of those that are there already."""
    os.environ.update(dict.fromkeys(_VARIABLES, str(threads)))
    if (torch := sys.modules.get("torch")) is not None:
        torch.set_num_threads(threads)
    if (numba := sys.modules.get("numba")) is not None:
        numba.config.reload_config()  # reads the variable, as every compilation does, which refuses another number
        with _nameless_locks():
            numba.set_num_threads(threads)  # which starts OpenMP with a thread per core
    if "numpy" in sys.modules:
        from threadpoolctl import threadpool_limits

        threadpool_limits(threads)


@contextlib.contextmanager
def _nameless_locks() -> Iterator[None]:
    """Have locks made as for processes that are forked, without a name in the system.

    One with a name is left behind where the process is stopped just then, and is told of when the run ends.
    """
    before = multiprocessing.get_start_method()
    if "fork" in multiprocessing.get_all_start_methods():
        multiprocessing.set_start_method("fork", force=True)
    try:
        yield
    finally:
        multiprocessing.set_start_method(before, force=True)


def threads_in_force() -> int:
    """The most threads that a numerical library of this process uses, as it says itself."""
    from threadpoolctl import threadpool_info

    counts = [library["num_threads"] for library in threadpool_info()]
    if (torch := sys.modules.get("torch")) is not None:
        counts.append(torch.get_num_threads())
    if (numba := sys.modules.get("numba")) is not None:
        counts.append(numba.get_num_threads())
    return max(counts, default=1)


def limit_memory(gib: float) -> None:
    """Have the process fail to get more memory than that, where the system can (Linux), instead of the machine."""
    if sys.platform == "linux":
        import resource

        _, most = resource.getrlimit(resource.RLIMIT_DATA)
        wanted = int(gib * GIB)
        resource.setrlimit(resource.RLIMIT_DATA, (wanted if most < 0 else min(wanted, most), most))


def reuse_memory() -> None:
    """Have malloc keep the arrays that are freed for those that come next, where it can be told to (glibc).

    It would give each of more than some hundred kB back to the system, which fills a new one with zeros page by page:
    a quarter of the time of some fits. The process ends with its job, and returns all of it then.
    """
    trim_threshold, top_pad, mmap_threshold = -1, -2, -3  # malloc.h
    with contextlib.suppress(OSError, AttributeError, TypeError):
        allocator = ctypes.CDLL(None)
        allocator.mallopt(mmap_threshold, GIB)
        allocator.mallopt(trim_threshold, GIB)
        allocator.mallopt(top_pad, GIB // 64)


def silence() -> None:
    """Discard what a model prints: megabytes of it would hide the progress, or fill a pipe that nobody reads."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)
    os.close(nowhere)
