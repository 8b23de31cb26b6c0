"""Independent pieces of one computation side by side, on the cores that this process may use."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")

MOST = 8  # processes; a round of the search has some twenty pieces
_pool: ContextVar[ProcessPoolExecutor | None] = ContextVar("_pool", default=None)


def cores() -> int:
    """Count the cores that this process may use: those that it is bound to, or as many as NUMBA_NUM_THREADS says."""
    told = os.environ.get("NUMBA_NUM_THREADS", "")
    if told.isdigit():
        return int(told)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def one_thread() -> Iterator[None]:
    """Have linear algebra use one thread within this block, or in the function that this decorates.

    Over small matrices threads only wait for each other, by spinning, and for very long where other programs have the
    cores.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        yield


@contextmanager
def all_cores() -> Iterator[None]:
    """Have `on_cores` use all cores within this block, and linear algebra one thread.

    The processes of `on_cores` are forked from this one when they are first needed, so that they import nothing.
    Threads gain nothing here: half of their time goes by between two compiled loops. Only the main process of a program
    forks, and only on Linux.
    """
    count = min(MOST, cores())
    with one_thread():
        if count < 2 or sys.platform != "linux" or multiprocessing.parent_process() is not None or _pool.get():
            yield
            return
        pool = ProcessPoolExecutor(count, multiprocessing.get_context("fork"), _begin)
        before = _pool.set(pool)
        try:
            yield
        finally:
            _pool.reset(before)
            pool.shutdown(cancel_futures=True)


def on_cores(work: Callable[[T], R], items: Sequence[T]) -> list[R]:
    """Do the work on all items and return the results in their order. Work and items must be such as pickle takes."""
    pool = _pool.get()
    if pool is None or len(items) < 2:
        return [work(item) for item in items]
    try:
        return list(pool.map(work, items))
    except BrokenProcessPool:  # one of them was killed: the system had no memory left, as a rule
        _pool.set(None)
        return [work(item) for item in items]


def end_with_parent() -> None:
    """End this process when its parent ends: a run that is killed cannot stop its workers."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _begin() -> None:
    """Leave Ctrl-C to the parent, end when it ends, and use one thread."""
    from threadpoolctl import threadpool_limits

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=end_with_parent, daemon=True).start()
    _pool.set(None)
    threadpool_limits(1)
