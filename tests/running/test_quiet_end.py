"""A run ends without a word of the processes that it no longer needs."""

import subprocess
import sys

# Limits that a process reads while it starts, so late and so deaf that the pool is gone before it goes on.
LATE = """
import os, signal, time
from dataclasses import dataclass
from simgap.running.workers import Limits


@dataclass(frozen=True)
class Late(Limits):
    note: str = ""

    def __reduce__(self):
        return late, (self.__dict__,)


def late(fields):
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    with open(fields["note"], "a") as note:
        note.write("started\\n")
    time.sleep(1.0)
    return Late(**fields)


class Nothing:
    preload, gpus = (), 0

    def execute(self):
        return []
"""
RUN = """
import sys, time
from pathlib import Path
from late import Late, Nothing
from simgap.running.engines.local import Local

note = Path(sys.argv[1])
events = Local(1, Late(1, note=str(note)))([Nothing()])
next(events)
while not note.exists():
    time.sleep(0.01)
events.close()
"""


def test_a_process_that_still_starts_when_the_run_ends_says_nothing(tmp_path):
    (tmp_path / "late.py").write_text(LATE)
    (tmp_path / "run.py").write_text(RUN)
    ended = subprocess.run(
        [sys.executable, tmp_path / "run.py", tmp_path / "note"],
        check=False, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert (ended.returncode, ended.stderr) == (0, "")


REGISTERED = """
import multiprocessing.resource_tracker as tracker
from simgap.running.workers import limit_threads
import numba

names = []
tracker.register = lambda name, kind: names.append(name)
limit_threads(1)
assert not names, names
"""


def test_a_process_that_is_stopped_while_it_starts_leaves_no_lock_behind():
    # As in the processes of jobs, where locks have names in the system.
    start = "import multiprocessing; multiprocessing.set_start_method('forkserver')\n"
    ended = subprocess.run([sys.executable, "-c", start + REGISTERED], check=False, capture_output=True, text=True)
    assert (ended.returncode, ended.stderr) == (0, "")
