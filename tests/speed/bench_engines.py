"""What a job costs beside its fit, and how jobs scale: on this machine, and on a Ray cluster of as many nodes."""

import os
from pathlib import Path
from time import perf_counter

import numpy as np
import pytest

import simgap
from simgap.data import save
from simgap.records import Channels, Dataset, Experiment, TrainingSet

MODELS = '''
import time
import numpy as np

class Idle:
    """The mean; takes no time."""
    def fit(self, data, seed):
        self.mean = data.train[0].y.mean(axis=0)
    def simulate(self, u, y_init):
        return np.full((len(u), u.shape[1] - y_init.shape[1], 1), self.mean)

class Sleeps(Idle):
    """Waits for a second."""
    def fit(self, data, seed):
        super().fit(data, seed)
        time.sleep(1)

class Computes(Idle):
    """Computes for about a second on one core."""
    def fit(self, data, seed):
        super().fit(data, seed)
        x = 0.0
        for i in range(12_000_000):
            x += i * x % 3
'''
JOBS = 16


@pytest.fixture(scope="module")
def suite(tmp_path_factory):
    """`suite("Idle")` is a suite of JOBS jobs of that model."""
    folder = tmp_path_factory.mktemp("engines")
    (folder / "models.py").write_text(MODELS)
    rng = np.random.default_rng(0)
    parts = [Experiment(name, rng.normal(size=(60, 1)), rng.normal(size=(60, 1)), 0.1) for name in "abc"]
    channels = Channels.unnamed(1, 1)
    save(Dataset("noise", TrainingSet((parts[0],), (parts[1],), 4, channels), (parts[2],), 4, channels),
         folder / "noise")  # fmt: skip

    def write(model: str, jobs: int = JOBS) -> str:
        path = folder / f"{model}.toml"
        path.write_text(f'datasets = ["noise"]\nseeds = {jobs}\n[[models]]\nname = "models.py:{model}"\n')
        return str(path)

    return write


def timed(suite: str, out: Path, **chosen) -> float:
    """Seconds of a run in which every job succeeds."""
    start = perf_counter()
    rows = simgap.run(suite, out=out, progress=lambda progress: None, **chosen)
    seconds = perf_counter() - start
    assert {row.status for row in rows} == {"ok"}
    return seconds


def local(workers):
    return {"jobs": workers}


@pytest.fixture
def cluster():
    """`cluster(4)` are the arguments for a run on as many nodes with one processor each."""
    ray = pytest.importorskip("ray", reason="Ray is not installed: pip install 'simgap[ray]'")
    from ray.cluster_utils import Cluster

    made = []

    def start(workers):
        nodes = Cluster()
        made.append(nodes)
        nodes.add_node(num_cpus=0, object_store_memory=80_000_000, include_dashboard=False)
        for _ in range(workers):
            nodes.add_node(num_cpus=1, object_store_memory=80_000_000)
        return {"engine": "ray", "address": nodes.address}

    yield start
    ray.shutdown()
    for nodes in made:
        nodes.shutdown()


@pytest.mark.parametrize("engine", ["local", "ray"])
@pytest.mark.parametrize("workers", [1, 2, 4])
def test_jobs_on_1_2_and_4_workers(engine, workers, suite, cluster, tmp_path, note):
    chosen = local(workers) if engine == "local" else cluster(workers)
    timed(suite("Idle", 2 * workers), tmp_path / "first", **chosen)  # the first jobs of a worker import what is needed
    seconds = {model: timed(suite(model), tmp_path / model, **chosen) for model in ("Idle", "Sleeps", "Computes")}
    note(
        f"{engine}, {workers} workers, {os.cpu_count()} cores: {1e3 * seconds['Idle'] / JOBS:.0f} ms a job that does "
        f"nothing; {JOBS} jobs of 1 s asleep {seconds['Sleeps']:.1f} s, computing {seconds['Computes']:.1f} s"
    )
