"""What an engine is: jobs go in, their rows come out in the order in which they end."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass

from simgap.records import Result
from simgap.running.jobs import Job


@dataclass(frozen=True)
class Running:
    """A job that is under way, and the share of it that is done as far as it says."""

    job: Job
    share: float = 0.0


# What an engine yields: the rows of a job that has ended, or, a few times a second, what is under way.
Event = list[Result] | tuple[Running, ...]


# Executes jobs, each in a process of its own; closing the generator stops what is under way.
Engine = Callable[[Sequence[Job]], Generator[Event, None, None]]
