"""Work on a Ray cluster: the same work, the same rows."""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from simgap.records import UnusableInput
from simgap.registry import ENGINES
from simgap.running.engines.engine import Event, Work
from simgap.running.engines.local import Local
from simgap.running.workers import Limits

# How often a job is tried again because its node went away; what the model does is a row and is not tried again.
RETRIES = 5
# Jobs handed to Ray beyond those that its processors can take, so that no node waits for this process.
AHEAD = 2
PATIENCE = 10.0  # seconds, for an answer of the cluster
VISIBLE = "CUDA_VISIBLE_DEVICES"


@ENGINES.register("ray")
@dataclass(frozen=True)
class Cluster:
    """A Ray cluster: as many jobs at a time as it has processors and, where models ask for them, GPUs.

    `workers` is ignored. `address` is that of the cluster, or in RAY_ADDRESS. Every node needs simgap and the same
    files under the same names. Raises UnusableInput, before any work is done, when Ray is missing or nobody answers.
    """

    workers: int
    limits: Limits
    address: str = ""

    def __post_init__(self) -> None:
        if not self.address:
            object.__setattr__(self, "address", os.environ.get("RAY_ADDRESS", ""))
        if not self.address:
            raise UnusableInput("--engine ray: say where the cluster is: --address HOST:PORT")
        try:
            import ray  # type: ignore[import-not-found]  # noqa: F401
        except ImportError as error:
            raise UnusableInput("--engine ray: Ray is not installed: pip install 'simgap[ray]'") from error
        if self.address != "auto":  # Ray itself would try for minutes
            try:
                host, _, port = self.address.removeprefix("ray://").rpartition(":")
                socket.create_connection((host, int(port)), timeout=PATIENCE).close()
            except (OSError, ValueError) as error:
                raise UnusableInput(f"--engine ray: there is no cluster at {self.address}: {error}") from error

    @staticmethod
    def threads(workers: int) -> int:
        """One processor for each job."""
        return 1

    def __call__(self, todo: Sequence[Work]) -> Generator[Event, None, None]:
        """Rows as they come; what is under way is Ray's to tell."""
        if not todo:
            return
        import ray  # type: ignore[import-not-found]

        with _connected(ray, self.address):
            task = ray.remote(num_cpus=self.limits.threads, max_retries=RETRIES)(_on_a_node)
            waiting = [work.portable() for work in reversed(todo)]
            at_once = max(8, int(AHEAD * ray.cluster_resources().get("CPU", 1)))
            pending: dict[Any, Work] = {}
            try:
                while waiting or pending:
                    while waiting and len(pending) < at_once:
                        work = waiting.pop()
                        pending[task.options(num_gpus=work.gpus).remote(work, self.limits)] = work
                    ended, _ = ray.wait(list(pending), timeout=0.5)
                    for reference in ended:
                        yield _rows_of(ray, reference, pending.pop(reference))
                    yield ()
            finally:
                for reference in pending:
                    ray.cancel(reference, force=True)


def _on_a_node(work: Work, limits: Limits) -> list[Any]:
    """Runs on the cluster: one piece of work in a process of its own, as on one machine."""
    if not work.has_its_code():
        return work.failed("error", "this node of the cluster has another version of the code")
    environment = {name: path for name, path in limits.environment.items() if Path(path).parent.is_dir()}
    if VISIBLE in os.environ:
        environment[VISIBLE] = os.environ[VISIBLE]  # the GPU, or the part of it, that Ray gives to this job
    events = Local(1, replace(limits, environment=environment))([work])
    with contextlib.closing(events):
        return next(event for event in events if isinstance(event, list))


@contextlib.contextmanager
def _connected(ray: Any, address: str) -> Iterator[None]:
    """A connection to the cluster; one that the caller's script has made is used and left as it is."""
    if ray.is_initialized():
        yield
        return
    try:
        ray.init(address=address, log_to_driver=False, logging_level="ERROR")
    except (OSError, ValueError, RuntimeError) as error:
        raise UnusableInput(f"--engine ray: there is no cluster at {address}: {str(error)[:200]}") from error
    try:
        yield
    finally:
        ray.shutdown()


def _rows_of(ray: Any, reference: Any, work: Work) -> list[Any]:
    try:
        rows: list[Any] = ray.get(reference)
    except ray.exceptions.RayError as error:
        text = " ".join(str(error).split())[:300]
        return work.failed("error", f"the cluster lost this job: {type(error).__name__}: {text}")
    return rows
