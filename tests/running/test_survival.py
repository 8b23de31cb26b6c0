"""Nothing is lost: runs and workers killed at random moments, full disks, two runs at once."""

import contextlib
import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import simgap
from simgap.records import UnusableInput
from simgap.results import store

RUN = [sys.executable, "-c", "import sys; from simgap.cli import main; sys.exit(main())"]
JOBS = ("Mean", "Sleeps", "Scaled", "Warns", "IsNaN")


def lines_of(out):
    return [line for file in sorted((out / "mine").glob("*.jsonl")) for line in file.read_text().splitlines()]


def family(session):
    """The processes of a session: the run, the process its workers are forked from, the workers."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            pid, _, rest = stat.read_text().partition(" (")
            if int(rest.rpartition(")")[2].split()[3]) == session:
                found.append(int(pid))
    return found


def complete_and_single(out, results):
    """Every owed row is in the files once, and what the last run returned is what they hold."""
    lines = lines_of(out)
    rows = [json.loads(line) for line in lines]
    keys = {(row["model"], row["experiment"], row["task"], row["seed"]) for row in rows}
    expected = {(model, e, t, s) for model in JOBS for e in ("first", "second") for t in ("free_run", "forecast")
                for s in (0, 1)}  # fmt: skip
    assert keys == expected
    assert len(lines) == len(expected)
    assert sorted(lines) == sorted(map(store.encode, results))


def kill_at_random(command, out, times, draw):
    """Start the same run again and again and kill it, or one of its processes, after a random time."""
    survived = {"run": 0, "another process": 0}
    for _ in range(times):
        process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )
        # Long enough for a start and some jobs; a finished run is begun anew.
        time.sleep(draw.uniform(0.0, 3.0))
        others = [pid for pid in family(process.pid) if pid != process.pid]
        with contextlib.suppress(ProcessLookupError):
            if others and draw.random() < 0.5:
                os.kill(draw.choice(others), signal.SIGKILL)
                survived["another process"] += 1
                time.sleep(draw.uniform(0.0, 0.5))
            else:
                survived["run"] += 1
            os.kill(process.pid, signal.SIGKILL)
        process.wait()
        if len(list((out / "mine").glob("*.jsonl"))) == len(JOBS) and draw.random() < 0.5:
            victim = draw.choice(sorted((out / "mine").glob("*.jsonl")))
            victim.write_text("".join(line + "\n" for line in victim.read_text().splitlines()[:1]))
    return survived


@pytest.mark.slow
def test_killed_at_random_moments_the_next_run_finishes_what_is_missing(suite, tmp_path):
    out, seed = tmp_path / "out", random.SystemRandom().randrange(1 << 30)
    chosen = suite(*JOBS, seeds=2)
    survived = kill_at_random([*RUN, "run", chosen, "--jobs", "2", "--out", str(out)], out, 100, random.Random(seed))
    print(f"seed {seed}: kills {survived}")
    complete_and_single(out, simgap.run(chosen, jobs=2, out=out))


def test_a_killed_worker_is_a_row_and_the_run_goes_on(suite, tmp_path):
    out = tmp_path / "out"
    command = [*RUN, "run", suite("Waits", "Mean"), "--out", str(out)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, cwd=tmp_path) as process:
        while not (tmp_path / "pid.txt").exists() or not (tmp_path / "pid.txt").read_text():
            time.sleep(0.05)
        os.kill(int((tmp_path / "pid.txt").read_text()), signal.SIGKILL)
        assert process.wait(timeout=60) == 1
    rows = {row.model: row for row in store.read(out / "mine")}
    assert rows["Mean"].status == "ok"
    assert "was ended by SIGKILL" in rows["Waits"].message


@pytest.mark.slow
def test_two_runs_on_one_store_leave_every_row_once(suite, tmp_path):
    out = tmp_path / "out"
    chosen = suite(*JOBS, seeds=2)
    command = [*RUN, "run", chosen, "--jobs", "2", "--out", str(out)]
    both = [subprocess.Popen(command, stdout=subprocess.DEVNULL) for _ in range(2)]
    assert [process.wait(timeout=120) for process in both] == [0, 0]
    complete_and_single(out, simgap.run(chosen, out=out))


@pytest.mark.slow
def test_a_disk_that_fills_up_ends_the_run_with_a_sentence_and_loses_nothing(suite, tmp_path):
    out = tmp_path / "out"
    chosen = suite(*JOBS, seeds=2)
    size = 3000  # bytes of a file, after which the system takes a part of a write and then none

    def full_disk():
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

    command = [*RUN, "run", chosen, "--out", str(out)]
    ended = subprocess.run(command, check=False, capture_output=True, text=True,
                           preexec_fn=full_disk, timeout=120)  # fmt: skip
    assert ended.returncode == 2
    assert "cannot be read or written" in ended.stderr
    assert len(ended.stderr.splitlines()) == 1
    for line in lines_of(out):  # no torn line, even before the next run
        json.loads(line)
    complete_and_single(out, simgap.run(chosen, out=out))


def test_a_folder_that_cannot_be_written_is_refused_before_anything_runs(suite, tmp_path):
    (tmp_path / "file").write_text("")
    events = []
    with pytest.raises(UnusableInput, match="results cannot be written into"):
        simgap.run(suite("Mean"), out=tmp_path / "file" / "out", progress=events.append)
    assert events == []


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_read_only_folder_is_refused_before_anything_runs(suite, tmp_path):
    (tmp_path / "out").mkdir(mode=0o500)
    with pytest.raises(UnusableInput, match="Permission denied"):
        simgap.run(suite("Mean"), out=tmp_path / "out")
