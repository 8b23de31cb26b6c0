"""What an ARX fit costs as the record grows to 1e7 samples, and what compiling the kernels costs once."""

import json
import os
import statistics
import subprocess
import sys

import pytest

FIT = """
import json, sys
from time import perf_counter
import numpy as np
from scipy.signal import lfilter
from simgap.baselines.arx import Arx
from simgap.records import Experiment, TrainingSet

def peak():  # of this process alone, which getrusage does not give after a fork
    with open("/proc/self/status") as status:
        return 1024 * next(int(line.split()[1]) for line in status if line.startswith("VmHWM"))

def record(samples):  # made in pieces, so that nothing but the data is ever large
    rng, state = np.random.default_rng(0), np.zeros(2)
    u, y = np.empty((samples, 1)), np.empty((samples, 1))
    for start in range(0, samples, 10_000):
        piece = slice(start, start + 10_000)
        u[piece] = rng.standard_normal(u[piece].shape)
        noise = 0.1 * rng.standard_normal(len(u[piece]))
        y[piece, 0], state = lfilter([0, 1, 0.5], [1, -1.5, 0.7], u[piece, 0] + noise, zi=state)
    return TrainingSet((Experiment("e", u, y, 1.0),), (), 10)

def seconds(data):
    start = perf_counter()
    Arx(na=2, nb=2, nk=1).fit(data, 0)
    return perf_counter() - start

seconds(record(10_000))
before = peak()
data = record(int(sys.argv[1]))
times = [seconds(data) for _ in range(int(sys.argv[2]))]
size = data.train[0].u.nbytes + data.train[0].y.nbytes
print(json.dumps({"seconds": times, "memory": (peak() - before) / size}))
"""

KERNELS = """
from time import perf_counter
import numba, simgap
start = perf_counter()
import simgap.baselines.estimation.kernels
print(perf_counter() - start)
"""


def answer(script: str, *arguments: object, **environment: str):
    command = [sys.executable, "-c", script, *map(str, arguments)]
    run = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=True)
    return json.loads(run.stdout)


@pytest.mark.skipif(sys.platform != "linux", reason="the peak memory of a process is read from /proc")
def test_arx_memory_is_at_most_twice_that_of_the_data(note):
    memory = answer(FIT, 10_000_000, 1)["memory"]
    note(f"- ARX(2,2), 1e7 samples: peak memory {memory:.2f} times that of the data (limit 2)")
    assert memory <= 2


@pytest.mark.skipif(sys.platform != "linux", reason="the peak memory of a process is read from /proc")
def test_arx_time_grows_in_proportion_to_the_samples(note):
    lengths, rounds = (100_000, 1_000_000, 10_000_000), 3
    times = {length: [] for length in lengths}
    for _ in range(rounds):  # in turns, so that a noisy machine hits all lengths
        for length in lengths:
            times[length] += answer(FIT, length, 5)["seconds"]
    nanoseconds = {length: 1e9 * statistics.median(times[length]) / length for length in lengths}
    note("- ARX(2,2), per sample: " + ", ".join(f"{t:.1f} ns at {n:.0e}" for n, t in nanoseconds.items()))
    assert nanoseconds[10_000_000] <= 2 * nanoseconds[1_000_000]
    assert nanoseconds[10_000_000] <= 2 * nanoseconds[100_000]


def test_kernels_are_compiled_once(note, tmp_path):
    cache = {"NUMBA_CACHE_DIR": str(tmp_path)}
    compiled, loaded = (answer(KERNELS, **cache) for _ in range(2))
    note(f"- import of the kernels: {compiled:.1f} s where numba compiles, {loaded:.2f} s from its cache")
    assert loaded < compiled / 2
