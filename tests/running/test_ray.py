"""A real Ray cluster of several nodes on this machine."""

import socket
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

import simgap
from simgap.cli import main
from simgap.records import UnusableInput
from simgap.results import store

ray = pytest.importorskip("ray", reason="Ray is not installed: pip install 'simgap[ray]'")
pytestmark = pytest.mark.filterwarnings("ignore")  # of Ray's own


@contextmanager
def cluster(*nodes):
    """Nodes with those resources; yields the cluster and its nodes."""
    from ray.cluster_utils import Cluster

    made = Cluster()
    try:
        yield made, [made.add_node(object_store_memory=80_000_000, include_dashboard=False, **node) for node in nodes]
    finally:
        ray.shutdown()
        made.shutdown()


def keys(rows):
    return sorted(map(store.key, rows))


@pytest.mark.slow
def test_the_rows_are_those_of_one_machine_and_a_node_killed_in_the_middle_costs_none(suite, tmp_path):
    chosen = suite("Mean", "RaisesInFit", "Crashes", "Hangs", "Sleeps", "IsNaN", timeout=6, seeds=4)
    here = {store.key(row): row for row in simgap.run(chosen, jobs=2, out=tmp_path / "here")}
    with cluster({"num_cpus": 0}, {"num_cpus": 1}, {"num_cpus": 1}) as (nodes, (_, _, victim)):
        killed = []

        def kill_when_some_are_done(progress):
            if progress.done >= 6 and not killed:
                killed.append(progress.done)
                nodes.remove_node(victim, allow_graceful=False)

        out = tmp_path / "there"
        rows = simgap.run(chosen, engine="ray", address=nodes.address, out=out, progress=kill_when_some_are_done)
        assert killed
    assert keys(rows) == sorted(here) == keys(store.read(out / "mine"))
    assert len([line for file in (out / "mine").iterdir() for line in file.read_text().splitlines()]) == len(here)
    for row in rows:
        alone = here[store.key(row)]
        assert (row.status, row.message, row.metrics) == (alone.status, alone.message, alone.metrics)


@pytest.mark.slow
def test_a_model_gets_the_part_of_a_gpu_that_it_asks_for(suite, tmp_path):
    chosen = suite("SeesGpu", "Mean")
    Path(chosen).write_text(Path(chosen).read_text().replace(':SeesGpu"\n', ':SeesGpu"\ngpus = 0.5\n'))
    with cluster({"num_cpus": 1, "num_gpus": 1}) as (nodes, _):
        rows = simgap.run(chosen, engine="ray", address=nodes.address, out=tmp_path / "out")
    assert {row.fitted["visible"] for row in rows if row.model == "SeesGpu"} == {"0"}


def test_without_a_cluster_the_run_is_refused(suite, tmp_path, capfd):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    for wrong in (address, "nonsense", "ray://127.0.0.1:x"):
        assert main(["run", suite("Mean"), "--engine", "ray", "--address", wrong, "--out", str(tmp_path / "out")]) == 2
        (line,) = capfd.readouterr().err.splitlines()
        assert line.startswith(f"simgap: --engine ray: there is no cluster at {wrong}: ")


@pytest.mark.slow
def test_the_cases_of_the_recovery_study_run_on_a_cluster_as_on_one_machine(tmp_path):
    from dataclasses import replace

    from simgap.diagnosis.recovery import CaseJob, Grid, recovery
    from simgap.running.engines import ray as engine
    from simgap.running.execution import Execution
    from simgap.running.workers import Limits

    grid = Grid(rigs=("cart",), seeds=0, pairs=1, clean=1)
    alone = recovery(grid, Execution(out=tmp_path / "here"))
    with cluster({"num_cpus": 1}) as (nodes, _):
        spread = recovery(grid, Execution("ray", options={"address": nodes.address}, out=tmp_path / "there"))
    assert [replace(row, seconds=0.0) for row in spread] == [replace(row, seconds=0.0) for row in alone]
    (row,) = engine._on_a_node(CaseJob(alone[0].case, "0" * 64), Limits(1))
    assert "another version of the code" in row.message


def test_a_node_with_other_code_of_the_model_says_so(suite, tmp_path, example):
    from dataclasses import replace

    from simgap.running import planning
    from simgap.running.engines import ray as engine
    from simgap.running.provenance import provenance
    from simgap.running.suites import load_suite
    from simgap.running.workers import Limits

    chosen = load_suite(suite("Mean"))
    data = planning.choose_data(chosen, (), print)
    (job,) = planning.plan(chosen, chosen.models, data, provenance(1))
    other = replace(job, provenance=job.provenance | {"model_sha256": "0" * 64})
    rows = engine._on_a_node(other, Limits(1))
    assert {row.message for row in rows} == {"this node of the cluster has another version of the code"}


def test_ray_missing_is_said_in_one_sentence(suite, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(UnusableInput, match="Ray is not installed"):
        simgap.run(suite("Mean"), engine="ray", address="auto", out=tmp_path / "out")
