"""Experiments of equal length, stacked so that one call filters them all, and a part of many."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simgap.records import Experiment


def stack(experiments: Sequence[Experiment]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Stack experiments to (u [B, T, nu], y [B, T, ny]) for each length T that occurs, in the order given."""
    by_length: dict[int, list[Experiment]] = {}
    for experiment in experiments:
        by_length.setdefault(len(experiment), []).append(experiment)
    return [(np.stack([e.u for e in group]), np.stack([e.y for e in group])) for group in by_length.values()]


def excerpt(experiments: Sequence[Experiment], samples: int) -> list[Experiment]:
    """Take experiments until there are enough samples, of the last one its end: records often begin at rest."""
    taken: list[Experiment] = []
    for experiment in experiments:
        if samples > 0:
            taken.append(experiment[max(len(experiment) - samples, 0) :])
            samples -= len(experiment)
    return taken
