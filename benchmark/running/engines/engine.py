"""What an engine is: work goes in, its rows come out in the order in which it ends."""

from __future__ import annotations

import contextlib
import hashlib
import os
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from simgap.records import Status


@runtime_checkable
class Work(Protocol):
    """What is executed in a process of its own, such as a fit with its simulations. An engine never reads the rows."""

    @property
    def preload(self) -> tuple[str, ...]:
        """Modules that take seconds to import: imported once, in the process from which others are forked."""
        ...

    @property
    def gpus(self) -> float:
        """How many GPUs, or what part of one, a cluster sets apart for it."""
        ...

    def execute(self) -> list[Any]:
        """Do it and return its rows. Whatever goes wrong short of the end of the process is a row too."""
        ...

    def failed(self, status: Status, message: str) -> list[Any]:
        """All rows, saying that and why there are none."""
        ...

    def portable(self) -> Work:
        """The same for a process in another folder: paths are absolute."""
        ...

    def has_its_code(self) -> bool:
        """Whether the code at hand, on a node of a cluster say, is that which it was planned with."""
        ...


@dataclass(frozen=True)
class Running:
    """Work that is under way, and the share of it that is done as far as it says."""

    work: Work
    share: float = 0.0


# What an engine yields: the rows of work that has ended, or, a few times a second, what is under way.
Event = list[Any] | tuple[Running, ...]


# Executes work, each in a process of its own; closing the generator stops what is under way. What is registered in
# ENGINES makes one: a class with the fields `workers`, `limits` and its own options, called like this, and with the
# static method `threads(workers)`, the threads of one job.
Engine = Callable[[Sequence[Work]], Generator[Event, None, None]]


def note_progress(folder: str, work: Work, done: int, total: int) -> None:
    """Write down how far work is, for the process that started it."""
    with contextlib.suppress(OSError):  # a full disk must not end a fit
        _progress_file(folder, work).write_text(f"{done} {total}", encoding="ascii")


def noted_share(folder: str, work: Work) -> float:
    """The share of the work that is done; zero if its process says nothing."""
    try:
        done, total = map(int, _progress_file(folder, work).read_text(encoding="ascii").split())
        return min(1.0, done / total)
    except (OSError, ValueError, ZeroDivisionError):
        return 0.0


def _progress_file(folder: str, work: Work) -> Path:
    return Path(folder) / hashlib.sha256(repr(work).encode("utf-8", "replace")).hexdigest()[:24]


def shared_folder() -> str | None:
    """The folder of the run, in which its processes leave notes and data for each other; None outside of a run."""
    return os.environ.get("SIMGAP_RUN")
