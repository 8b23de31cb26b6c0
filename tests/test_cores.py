"""Pieces of a computation side by side: the same results as one after the other, whatever happens to a process."""

import os
import signal
import sys

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from simgap.cores import all_cores, cores, on_cores
from simgap.data.simulated.rigs import hide
from simgap.diagnosis.diagnose import diagnose

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="other systems cannot fork safely")
MAIN = os.getpid()


@pytest.fixture(autouse=True)
def two_cores(monkeypatch):
    monkeypatch.setenv("NUMBA_NUM_THREADS", "2")


def process_of(item):
    return item, os.getpid()


def third_is_odd(item):
    if item == 3:
        raise ValueError("three")
    return item


def dies_elsewhere(item):
    if os.getpid() != MAIN:
        os.kill(os.getpid(), signal.SIGKILL)
    return item


def of_a_piece(item):
    return [process for _, process in on_cores(process_of, range(item))]


def test_results_come_in_the_order_of_the_items_and_from_other_processes():
    with all_cores():
        items, processes = zip(*on_cores(process_of, range(20)), strict=True)
    assert items == tuple(range(20)) and MAIN not in processes


def test_outside_of_all_cores_and_on_one_core_everything_runs_here(monkeypatch):
    assert on_cores(process_of, [1, 2]) == [(1, MAIN), (2, MAIN)]
    monkeypatch.setenv("NUMBA_NUM_THREADS", "1")
    with all_cores():
        assert on_cores(process_of, [1, 2]) == [(1, MAIN), (2, MAIN)]


def test_linear_algebra_has_one_thread_within_all_cores_and_its_own_number_after(monkeypatch):
    for count in ("1", "2"):
        monkeypatch.setenv("NUMBA_NUM_THREADS", count)
        with threadpool_limits(2):
            with all_cores():
                assert {library["num_threads"] for library in threadpool_info()} == {1}
            assert {library["num_threads"] for library in threadpool_info()} == {2}


def test_a_piece_does_its_own_pieces_itself():
    with all_cores():
        for processes in on_cores(of_a_piece, [2, 3]):
            assert len(set(processes)) == 1


def test_an_exception_of_a_piece_is_raised():
    with all_cores(), pytest.raises(ValueError, match="three"):
        on_cores(third_is_odd, range(5))


def test_where_a_process_is_killed_the_work_is_done_here():
    with all_cores():
        assert on_cores(dies_elsewhere, range(4)) == [0, 1, 2, 3]
        assert on_cores(process_of, range(2)) == [(0, MAIN), (1, MAIN)]


def test_cores_are_those_that_the_environment_names_or_that_the_process_is_bound_to(monkeypatch):
    assert cores() == 2
    monkeypatch.delenv("NUMBA_NUM_THREADS")
    assert cores() == len(os.sched_getaffinity(0))


def test_a_diagnosis_on_two_cores_is_that_on_one_to_the_bit(monkeypatch):
    answers = []
    for count in ("2", "1"):
        monkeypatch.setenv("NUMBA_NUM_THREADS", count)
        answers.append(diagnose(hide("cart", {"coulomb_friction": 1.0}, seed=4), views_too=False).to_json())
    for answer in answers:
        del answer["seconds"]
    assert answers[0] == answers[1] and answers[0]["causes"]
