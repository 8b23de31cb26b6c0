"""What repeated runs differ by: the error that no model of the input can take away."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from simgap.greybox.samples import sizes_of
from simgap.records import Experiment

ALIKE = 0.01  # of an input's spread: what the inputs of repeated runs differ by, root mean square
STARTS = 0.3  # of an output's spread: what their first samples differ by, noise included
OVERLAP = 0.5  # of the longer run, that the shorter one lasts at least


def variance_of_repeats(
    experiments: Sequence[Experiment], errors: Sequence[np.ndarray], n_init: int
) -> Float[np.ndarray, " ny"] | None:
    """Compute the variance between runs with the same input, around their mean; None without any.

        s^2 = sum over groups, runs r and t of (e_r(t) - mean over r)^2 / sum of (runs of the group - 1)

    Errors of a simulation from each run's own start are compared, not outputs, so that a small difference of the
    starts counts no more than a model of the plant needs it to. Copies of one run are no repeats.
    """
    squares, freedom = np.zeros(experiments[0].y.shape[1]), 0
    for group in repeated(experiments, n_init):
        shortest = min(len(errors[i]) for i in group)
        e = np.stack([errors[i][:shortest] for i in group])  # [R, N, ny]
        squares += np.sum((e - e.mean(axis=0)) ** 2, axis=(0, 1))
        freedom += (len(group) - 1) * shortest
    return squares / freedom if freedom else None


def repeated(experiments: Sequence[Experiment], n_init: int) -> list[list[int]]:
    """Group the experiments that are runs of one input from nearly the same start, two at least."""
    sizes = sizes_of(np.concatenate([x.y for x in experiments]))
    means = [x.y[:n_init].mean(axis=0) for x in experiments]
    usual = sizes_of(np.concatenate([x.u for x in experiments]))
    spreads = [np.where(np.any(x.u, axis=0), sizes_of(x.u), usual) for x in experiments]
    groups: list[list[int]] = []
    for i, x in enumerate(experiments):
        alike = (
            group for group in groups
            if np.all(np.abs(means[i] - means[group[0]]) <= STARTS * sizes)
            and _same_input(x, experiments[group[0]], spreads[group[0]])
        )  # fmt: skip
        if (group := next(alike, None)) is None:
            groups.append([i])
        elif not any(np.array_equal(x.y, experiments[other].y) for other in group):
            group.append(i)
    return [group for group in groups if len(group) > 1]


def _same_input(one: Experiment, other: Experiment, spread: Float[np.ndarray, " nu"]) -> bool:
    shorter, longer = sorted((len(one), len(other)))
    if shorter < OVERLAP * longer:
        return False
    a, b = one.u[:shorter], other.u[:shorter]
    return bool(np.all(np.sqrt(np.mean((a - b) ** 2, axis=0)) <= ALIKE * spread))
