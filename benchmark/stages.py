"""At which stage a long computation is, in words, told to whoever listens."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_listener: ContextVar[Callable[[str], None] | None] = ContextVar("_listener", default=None)


@contextmanager
def told_to(listener: Callable[[str], None]) -> Iterator[None]:
    """Have `listener` called with the words of each stage that is entered within this block."""
    before = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(before)


def stage(words: str) -> None:
    """Say that a stage begins. Called in the process that leads a computation, never in one of its pieces."""
    listener = _listener.get()
    if listener is not None:
        listener(words)
