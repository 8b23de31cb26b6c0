"""Imported by the process from which those of the jobs are forked, so that numba is set up once for all of them."""

from __future__ import annotations

import os

from simgap.running.workers import threads_per_worker

# A job may have every core, and numba gives none more threads than it was told of when it was imported.
os.environ["NUMBA_NUM_THREADS"] = str(threads_per_worker(1))

from numba import njit

# The first thing that a process compiles, or reads from the cache, takes 0.3 s more than the second.
njit("float64(float64)")(lambda x: x)
