"""Work on an engine: its rows are stored as soon as they are there, and a listener hears how far it is."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from inspect import signature
from pathlib import Path
from typing import Any

from simgap.records import UnusableInput
from simgap.registry import ENGINES
from simgap.running.engines.engine import Engine, Running, Work
from simgap.running.workers import Limits


@dataclass(frozen=True)
class Progress:
    """How far a run is. `finished` holds the rows of the job that has just ended, if one has."""

    done: int = 0
    total: int = 0
    running: tuple[str, ...] = ()
    finished: tuple[Any, ...] = ()
    note: str = ""
    share: float = 0.0  # of all jobs, those under way counted as far as they say they are


Listener = Callable[[Progress], None]


def log_notes(progress: Progress) -> None:
    """Log what a run notes, for those who do not listen."""
    if progress.note:
        logging.getLogger("simgap").warning(progress.note)


@dataclass(frozen=True)
class Execution:
    """Where work is done, how much of it at a time, the folder of its rows, and who hears how far it is.

    `options` are those of some engines only, such as the address of a cluster; None for one that was not given.
    """

    engine: str = "local"
    jobs: int = 1
    options: dict[str, Any] = field(default_factory=dict)
    out: Path = Path("results")
    listener: Listener = log_notes

    def note(self, text: str) -> None:
        """Have the listener hear a sentence."""
        self.listener(Progress(note=text))

    @property
    def threads(self) -> int:
        """Threads of one job. Raises UnusableInput for an engine that is not known or no worker at all."""
        if self.jobs < 1:
            raise UnusableInput(f"--jobs {self.jobs}: give at least one worker")
        return ENGINES[self.engine].threads(self.jobs)

    def start(self, timeout: float, memory: float) -> Engine:
        """The engine with limits for each job, in seconds and GiB. Raises UnusableInput for one that cannot be used."""
        # What an interrupted fit left to carry on from; gone with the fit.
        folders = {"SIMGAP_CHECKPOINTS": str(self.out.absolute() / ".checkpoints")}
        limits = Limits(self.threads, timeout, memory, folders)
        given = {name: value for name, value in self.options.items() if value is not None}
        taken = signature(ENGINES[self.engine]).parameters
        for name in given:
            if name not in taken:
                others = [other for other in ENGINES if not ENGINES.why_missing(other)]
                where = " or ".join(other for other in others if name in signature(ENGINES[other]).parameters)
                raise UnusableInput(f"--{name} is for --engine {where or '?'}: the engine {self.engine} takes none")
        return ENGINES[self.engine](workers=self.jobs, limits=limits, **given)


def carry_out(
    engine: Engine, todo: Sequence[Work], keep: Callable[[list[Any]], None], listener: Listener
) -> list[list[Any]]:
    """The rows of all work in the order in which it ended; `keep` stores those of each as soon as they are there."""
    ended: list[list[Any]] = []
    with contextlib.closing(engine(todo)) as events:
        for event in events:
            if isinstance(event, list):
                keep(event)
                ended.append(event)
                listener(Progress(len(ended), len(todo), finished=tuple(event)))
            else:
                listener(_under_way(len(ended), len(todo), event))
    return ended


def _under_way(ended: int, total: int, running: tuple[Running, ...]) -> Progress:
    names = tuple(f"{at.work} ({at.share:.0%})" if at.share else str(at.work) for at in running)
    return Progress(ended, total, names, share=(ended + sum(at.share for at in running)) / total)
