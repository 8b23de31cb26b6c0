"""A job has its share of the machine's threads, and its rows say how many it had."""

import os

import numba
import pytest
from threadpoolctl import threadpool_limits

import simgap
from simgap.running import planning
from simgap.running.engines.local import Local
from simgap.running.provenance import provenance
from simgap.running.suites import load_suite
from simgap.running.workers import Limits

CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


def test_threads_are_shared_out_among_the_workers(suite, tmp_path):
    rows = simgap.run(suite("Threads"), jobs=1000, out=tmp_path / "out")
    assert rows[0].fitted == {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    assert rows[0].provenance["threads"] == 1


@pytest.mark.parametrize("jobs", [1, 2])
def test_every_library_of_a_job_has_its_share_of_the_cores(suite, tmp_path, jobs):
    (row, *_) = simgap.run(suite("Libraries"), jobs=jobs, out=tmp_path / "out")
    share = max(1, CORES // jobs)
    assert row.fitted == {"torch": share, "numba": share, "blas": [share]}
    assert row.provenance["threads"] == share


def test_a_row_has_the_threads_that_its_job_had_and_not_those_that_were_planned(suite, folder):
    chosen = load_suite(suite("Mean"))
    (job,) = planning.plan(chosen, chosen.models, planning.choose_data(chosen, (), print), provenance(7))
    (rows,) = [event for event in Local(1, Limits(1))([job]) if isinstance(event, list)]
    assert {row.provenance["threads"] for row in rows} == {1}


def test_a_fit_in_the_foreground_says_how_many_threads_it_had(folder, example):
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        with threadpool_limits(1):
            rows = simgap.fit(example("Mean"), folder).results
    finally:
        numba.set_num_threads(before)
    assert {row.provenance["threads"] for row in rows} == {1}


def test_a_model_that_compiles_with_numba_has_its_share_of_threads(suite, tmp_path):
    (row, *_) = simgap.run(suite("Compiles"), jobs=1000, out=tmp_path / "out")
    assert (row.status, row.fitted) == ("ok", {"three": 3.0, "threads": 1})
