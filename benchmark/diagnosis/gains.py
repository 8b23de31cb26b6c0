"""The free-run error on test data without and with the causes, and the interval of the gain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from simgap.findings import Gain
from simgap.greybox.model import GreyBoxModel
from simgap.greybox.samples import sizes_of
from simgap.records import Dataset, Experiment

RESAMPLED = 2000  # draws
BLOCKS = 20  # that a single test experiment is cut into
# In units of the output's spread: the error of a simulation that grows without bound, and one that is rounding.
LARGEST_ERROR = 1e60
GROWN = 1e30
SMALLEST_ERROR = 1e-9


def free_run(model: GreyBoxModel, experiment: Experiment, n_init: int) -> Float[np.ndarray, "N ny"]:
    """Simulate rows n_init .. T-1 of one experiment from its first n_init samples."""
    return model.simulate(experiment.u[None], experiment.y[None, :n_init])[0]


def measure(dataset: Dataset, before: Sequence[np.ndarray], after: Sequence[np.ndarray], seed: int) -> Gain:
    """Compare the errors of two simulations of the test experiments, before and after the causes were added.

        share = 1 - |e_after| / |e_before|,   over all outputs, each divided by its standard deviation

    The 95 % interval comes from the bootstrap over test experiments, or over blocks of a single one (Efron and
    Tibshirani 1993, ch. 8 and 13).
    """
    n = dataset.n_init
    y = [x.y[n:] for x in dataset.test]
    scored, known = np.concatenate(y), np.concatenate([x.y for x in dataset.training.train])
    spread = np.where(scored.any(axis=0), sizes_of(scored), sizes_of(known))
    squares = []  # per block: samples, squared errors before [ny] and after [ny]
    for measured, *simulated in zip(y, before, after, strict=True):
        for rows in np.array_split(np.arange(len(measured)), BLOCKS if len(y) == 1 else 1):
            if len(rows):
                errors = [np.sum(_bounded((measured[rows] - y_hat[rows]) / spread) ** 2, axis=0) for y_hat in simulated]
                squares.append([np.full(len(spread), float(len(rows))), *errors])
    blocks = np.array(squares)  # [block, 3, ny]
    rng = np.random.default_rng(seed)
    drawn = blocks[rng.integers(0, len(blocks), (RESAMPLED, len(blocks)))].sum(axis=1)  # [draw, 3, ny]
    shares = _share(drawn)
    low, high = np.quantile(shares, (0.025, 0.975))
    total = blocks.sum(axis=0)
    share = _share(total[None])[0]
    rmse = np.sqrt(total[1:] / total[0])  # [2, ny], in units of the spread
    rmse = np.where(rmse < GROWN, rmse * spread, np.inf)
    names = [channel.name for channel in dataset.channels.outputs]
    return Gain(
        dict(zip(names, map(float, rmse[0]), strict=True)),
        dict(zip(names, map(float, rmse[1]), strict=True)),
        *(float(value) if value > -GROWN else -np.inf for value in (share, low, high)),
    )


def _bounded(error: np.ndarray) -> np.ndarray:
    return np.clip(np.where(np.isnan(error), LARGEST_ERROR, error), -LARGEST_ERROR, LARGEST_ERROR)


def _share(squares: Float[np.ndarray, "B 3 ny"]) -> Float[np.ndarray, " B"]:
    rounding, before, after = squares.sum(axis=2).T * [[SMALLEST_ERROR**2], [1], [1]]
    return 1 - np.sqrt((after + rounding) / (before + rounding))
