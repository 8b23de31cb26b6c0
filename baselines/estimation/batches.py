"""Experiments of equal length, stacked so that one call filters them all, and a part of many."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simgap.records import Experiment

SHORTEST = 1024  # samples of a long experiment in an excerpt


def stack(experiments: Sequence[Experiment]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Stack experiments to (u [B, T, nu], y [B, T, ny]) for each length T that occurs, in the order given."""
    by_length: dict[int, list[Experiment]] = {}
    for experiment in experiments:
        by_length.setdefault(len(experiment), []).append(experiment)
    return [(np.stack([e.u for e in group]), np.stack([e.y for e in group])) for group in by_length.values()]


def excerpt(experiments: Sequence[Experiment], samples: int) -> list[Experiment]:
    """Take so many samples of experiments, spread evenly over them, of each its end: records often begin at rest.

    The amplitude, or whatever else the experiments differ by, may grow from the first to the last. What short ones
    leave of their shares goes to the longest.
    """
    if sum(map(len, experiments)) <= samples:
        return list(experiments)
    usual = sum(map(len, experiments)) // len(experiments)
    count = min(max(samples // min(usual, SHORTEST), 1), len(experiments))
    share = samples // count
    places = np.linspace(0, len(experiments) - 1, count).round().astype(int).tolist()
    taken = {i: min(len(experiments[i]), share) for i in places}
    left = samples - sum(taken.values())
    for i in sorted(range(len(experiments)), key=lambda i: -len(experiments[i])):
        if left > share:
            more = min(len(experiments[i]) - taken.get(i, 0), left)
            taken[i], left = taken.get(i, 0) + more, left - more
    return [experiments[i][len(experiments[i]) - n :] for i, n in sorted(taken.items()) if n]
