"""What the causes gain on test data, with an interval from resampling."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from simgap.findings import Gain
from simgap.greybox.model import GreyBoxModel
from simgap.records import Dataset, Experiment

RESAMPLED = 2000
BLOCKS = 20  # of a single test experiment


def free_run(model: GreyBoxModel, experiment: Experiment, n_init: int) -> Float[np.ndarray, "N ny"]:
    """Simulate rows n_init .. T-1 of one experiment from its first n_init samples."""
    return model.simulate(experiment.u[None], experiment.y[None, :n_init])[0]


def measure(dataset: Dataset, before: Sequence[np.ndarray], after: Sequence[np.ndarray], seed: int) -> Gain:
    """RMSE before and after per output; share = 1 - |after| / |before| over all outputs, each in units of its spread.

    The 95 % interval resamples test experiments, or blocks where there is one (Efron and Tibshirani 1993, ch. 8, 13).
    """
    n = dataset.n_init
    y = [x.y[n:] for x in dataset.test]
    spread = np.std(np.concatenate(y), axis=0)
    spread = np.where(spread > 0, spread, 1.0)
    squares = []  # per block: samples, squared errors before [ny] and after [ny]
    for measured, b, a in zip(y, before, after, strict=True):
        for rows in np.array_split(np.arange(len(measured)), BLOCKS if len(y) == 1 else 1):
            if len(rows):
                errors = [np.sum(((measured[rows] - s[rows]) / spread) ** 2, axis=0) for s in (b, a)]
                squares.append([np.full(len(spread), float(len(rows))), *errors])
    table = np.array(squares)  # [block, 3, ny]
    rng = np.random.default_rng(seed)
    drawn = table[rng.integers(0, len(table), (RESAMPLED, len(table)))].sum(axis=1)  # [draw, 3, ny]
    shares = _share(drawn)
    low, high = np.quantile(shares, (0.025, 0.975))
    total = table.sum(axis=0)
    rmse = np.sqrt(total[1:] / total[0]) * spread  # [2, ny]
    names = [channel.name for channel in dataset.channels.outputs]
    return Gain(
        dict(zip(names, map(float, rmse[0]), strict=True)),
        dict(zip(names, map(float, rmse[1]), strict=True)),
        float(_share(total[None])[0]),
        float(low),
        float(high),
    )


def _share(table: Float[np.ndarray, "B 3 ny"]) -> Float[np.ndarray, " B"]:
    before, after = table[:, 1].sum(axis=1), table[:, 2].sum(axis=1)
    return 1 - np.sqrt(after / np.maximum(before, 1e-300))
