"""Work on an engine: its rows are stored as soon as they are there, and a listener hears how far it is."""

from __future__ import annotations

import contextlib
import logging
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simgap.records import UnusableInput
from simgap.running.engines.engine import Engine, Running, Work
from simgap.running.engines.local import Local
from simgap.running.workers import Limits, threads_per_worker


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
    """Where work is done, how much of it at a time, the folder of its rows, and who hears how far it is."""

    engine: str = "local"
    jobs: int = 1
    address: str | None = None
    out: Path = Path("results")
    listener: Listener = log_notes

    @property
    def threads(self) -> int:
        """Threads of one job: its share of this machine, one on a cluster."""
        return threads_per_worker(self.jobs) if self.engine == "local" else 1

    def note(self, text: str) -> None:
        """Have the listener hear a sentence."""
        self.listener(Progress(note=text))

    def start(self, timeout: float, memory: float) -> Engine:
        """The engine with limits for each job, in seconds and GiB. Raises UnusableInput for one that cannot be used."""
        if self.jobs < 1:
            raise UnusableInput(f"--jobs {self.jobs}: give at least one worker")
        # What an interrupted fit left to carry on from; gone with the fit.
        folders = {"SIMGAP_CHECKPOINTS": str(self.out.absolute() / ".checkpoints")}
        limits = Limits(self.threads, timeout, memory, folders)
        if self.engine == "local":
            if self.address is not None:
                raise UnusableInput("--address is for --engine ray: the engine local needs none")
            return Local(self.jobs, limits)
        if self.engine != "ray":
            raise UnusableInput(f"the engine {self.engine!r} is not known; choose local or ray")
        from simgap.running.engines.ray import Cluster

        if not (address := self.address or os.environ.get("RAY_ADDRESS")):
            raise UnusableInput("--engine ray: say where the cluster is: --address HOST:PORT")
        return Cluster(limits, address)


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
