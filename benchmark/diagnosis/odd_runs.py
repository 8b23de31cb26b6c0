"""Runs of a known machine that no model explains: it stuck, slipped, or something came loose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simgap.diagnosis.gains import free_run
from simgap.greybox.model import GreyBoxModel
from simgap.records import Dataset, Experiment
from simgap.wording import amount

FAR = 8.0  # times the error of the usual run
FEWEST = 8  # runs that tell what is usual
MOST_NAMED = 8


def odd_runs(model: GreyBoxModel, dataset: Dataset) -> tuple[str, ...]:
    """Name the runs whose mean absolute error is many times that of the median run, the worst first."""
    n, training = dataset.n_init, dataset.training
    runs: Sequence[Experiment] = [x for x in (*training.train, *training.valid, *dataset.test) if len(x) > n]
    if dataset.channels.plant is None or len(runs) < FEWEST:
        return ()
    errors = np.array([np.mean(np.abs(free_run(model, x, n) - x.y[n:])) for x in runs])
    usual, unit = float(np.median(errors)), dataset.channels.outputs[0].unit
    odd = [i for i in np.argsort(-errors) if errors[i] > FAR * usual][:MOST_NAMED]
    return tuple(
        f"The run {runs[i].name} is explained by no model: its mean absolute error is "
        f"{amount(float(errors[i]), unit, 2)}, {errors[i] / usual:.0f} times the usual one. "
        "The machine may have stuck or slipped there."
        for i in odd
    )
