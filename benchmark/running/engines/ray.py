"""Jobs on a Ray cluster: the same jobs, the same rows."""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from simgap.records import Result, UnusableInput
from simgap.running.engines.engine import Event
from simgap.running.engines.local import Local
from simgap.running.jobs import Job, model_code
from simgap.running.workers import Limits

# How often a job is tried again because its node went away; what the model does is a row and is not tried again.
RETRIES = 5
# Jobs handed to Ray beyond those that its processors can take, so that no node waits for this process.
AHEAD = 2
PATIENCE = 10.0  # seconds, for an answer of the cluster
VISIBLE = "CUDA_VISIBLE_DEVICES"


@dataclass(frozen=True)
class Cluster:
    """As many jobs at a time as the cluster at `address` has processors and, where models ask for them, GPUs.

    Every node needs simgap and the same files under the same names. Raises UnusableInput when there is no cluster.
    """

    limits: Limits
    address: str

    def __post_init__(self) -> None:
        """Raises UnusableInput, before any work is done, when Ray is missing or nobody answers at the address."""
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

    def __call__(self, todo: Sequence[Job]) -> Generator[Event, None, None]:
        """Rows as they come; what is under way is Ray's to tell."""
        if not todo:
            return
        import ray  # type: ignore[import-not-found]

        with _connected(ray, self.address):
            task = ray.remote(num_cpus=self.limits.threads, max_retries=RETRIES)(_on_a_node)
            waiting = [_with_absolute_paths(job) for job in reversed(todo)]
            at_once = max(8, int(AHEAD * ray.cluster_resources().get("CPU", 1)))
            pending: dict[Any, Job] = {}
            try:
                while waiting or pending:
                    while waiting and len(pending) < at_once:
                        job = waiting.pop()
                        pending[task.options(num_gpus=job.entry.gpus).remote(job, self.limits)] = job
                    ended, _ = ray.wait(list(pending), timeout=0.5)
                    for reference in ended:
                        yield _outcome(ray, reference, pending.pop(reference))
                    yield ()
            finally:
                for reference in pending:
                    ray.cancel(reference, force=True)


def _on_a_node(job: Job, limits: Limits) -> list[Result]:
    """Runs on the cluster: one job in a process of its own, as on one machine."""
    if model_code(job.entry).sha256() != job.provenance["model_sha256"]:
        return job.failed("error", "this node of the cluster has another version of the model's code")
    environment = {name: path for name, path in limits.environment.items() if Path(path).parent.is_dir()}
    if VISIBLE in os.environ:
        environment[VISIBLE] = os.environ[VISIBLE]  # the GPU, or the part of it, that Ray gives to this job
    events = Local(1, replace(limits, environment=environment))([job])
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


def _outcome(ray: Any, reference: Any, job: Job) -> list[Result]:
    try:
        rows: list[Result] = ray.get(reference)
    except ray.exceptions.RayError as error:
        text = " ".join(str(error).split())[:300]
        return job.failed("error", f"the cluster lost this job: {type(error).__name__}: {text}")
    return rows


def _with_absolute_paths(job: Job) -> Job:
    """A process on a node starts in another folder."""
    file, colon, name = job.entry.name.rpartition(":")
    entry = replace(job.entry, name=f"{Path(file).absolute()}:{name}") if colon else job.entry
    data = Path(job.source.data)
    source = replace(job.source, data=str(data.absolute())) if data.exists() else job.source
    return replace(job, entry=entry, source=source)
