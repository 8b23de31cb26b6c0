"""What a worker process does before it takes jobs. This module imports no NumPy: see `limit_threads`."""

import multiprocessing
import os
import threading

_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


def prepare_worker(threads: int, folders: dict[str, str] | None = None) -> None:
    """Limit the threads of this process, and end it when its parent ends.

    folders: environment variables that name where models may keep what they need to carry on (SIMGAP_CHECKPOINTS).
    """
    limit_threads(threads)
    os.environ.update(folders or {})
    threading.Thread(target=_end_with_parent, daemon=True).start()


def threads_per_worker(workers: int) -> int:
    """The machine's cores shared out among the workers, at least one each."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, cores // workers)


def limit_threads(threads: int) -> None:
    """Set the limit of the numerical libraries. It counts only before NumPy is imported."""
    os.environ.update(dict.fromkeys(_VARIABLES, str(threads)))


def _end_with_parent() -> None:
    """A run that is killed cannot stop its workers, and a model that hangs would hang on for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
