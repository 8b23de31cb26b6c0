"""The free-run error on test data without and with the causes, and the interval of the gain."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from simgap.error_views.correlation import correlation_time
from simgap.error_views.gain_interval import share_with_interval
from simgap.findings import Gain, InPieces
from simgap.greybox.model import GreyBoxModel
from simgap.greybox.past import Past
from simgap.greybox.samples import PIECE, sizes_of
from simgap.metrics import is_finite, relative, spread
from simgap.records import Dataset, Experiment

# In units of the output's spread: the error of a simulation that grows without bound, and one that is rounding.
LARGEST_ERROR = 1e60
GROWN = 1e30
SMALLEST_ERROR = 1e-9


def free_run(model: GreyBoxModel, experiment: Experiment, n_init: int) -> Float[np.ndarray, "N ny"]:
    """Simulate rows n_init .. T-1 of one experiment from its first n_init samples."""
    return model.simulate(experiment.u[None], experiment.y[None, :n_init], Past.of([experiment]))[0]


def measure(
    dataset: Dataset, before: Sequence[np.ndarray], after: Sequence[np.ndarray], own: Sequence[int] = ()
) -> Gain:
    """Compare the errors of two simulations of the test experiments, before and after the causes were added.

        share = 1 - |e_after| / |e_before|,   over all outputs, each divided by its standard deviation

    with the 95 % interval of `share_with_interval`. `own` numbers of each output were fitted to each test experiment
    itself, and take of the error even where nothing is there; `_price` puts that back.
    """
    n = dataset.n_init
    y = np.concatenate([x.y[n:] for x in dataset.test])  # [N, ny]
    known = np.concatenate([x.y for x in dataset.training.train])
    scale = np.where(y.any(axis=0), sizes_of(y), sizes_of(known))
    errors = [_bounded((y - np.concatenate(y_hat)) / scale) for y_hat in (before, after)]
    squares = [error**2 for error in errors]
    rmse = [np.sqrt(np.mean(square, axis=0)) for square in squares]  # in units of scale
    beats_mean = bool(np.any(rmse[1] < 1))
    rmse = [np.where(error < GROWN, error * scale, np.inf) for error in rmse]
    lengths = np.array([len(x) - n for x in dataset.test if len(x) > n])
    for j, count in enumerate(own):
        squares[1][:, j] *= _price(errors[1][:, j], lengths, count)
    loss_before, loss_after = (np.sum(square + SMALLEST_ERROR**2, axis=1) for square in squares)
    memory = max(correlation_time(signal, lengths, 0)[0] for error in errors for signal in error.T)
    shares = share_with_interval(loss_before, loss_after, lengths, memory)
    share, low, high = (value if value > -GROWN else -np.inf for value in shares)
    names = [channel.name for channel in dataset.channels.outputs]
    rmse_before, rmse_after = (dict(zip(names, map(float, errors), strict=True)) for errors in rmse)
    return Gain(rmse_before, rmse_after, share, low, high, beats_mean)


def in_pieces(dataset: Dataset, plain: GreyBoxModel, model: GreyBoxModel) -> InPieces | None:
    """Compare two models in free runs over pieces as long as those of the search, each from its own start.

    Returns None where no test experiment is that long.
    """
    pieces = [x[a : a + PIECE] for x in dataset.test for a in range(0, len(x) - PIECE + 1, PIECE)]
    if not pieces:
        return None
    u, y = (np.stack([getattr(x, signal) for x in pieces]) for signal in ("u", "y"))
    past = Past.of(pieces)
    before, after = (list(one.simulate(u, y[:, : dataset.n_init], past)) for one in (plain, model))
    gain = measure(replace(dataset, test=tuple(pieces)), before, after)
    return InPieces(PIECE, gain.share, gain.low, gain.high)


def _price(error: Float[np.ndarray, " N"], lengths: np.ndarray, own: int) -> float:
    """What the mean square of errors would grow by on data to which `own` numbers of each experiment were not fitted.

        (N / tau + p) / (N / tau - p)   for p numbers and N errors of memory tau

    (final prediction error: Akaike, Annals of the Institute of Statistical Mathematics 22, 1970).
    """
    fitted, independent = own * len(lengths), len(error) / correlation_time(error, lengths, 0)[0]
    return (independent + fitted) / max(independent - fitted, 1e-3)


def errors_by_output(dataset: Dataset, simulated: Sequence[np.ndarray]) -> dict[str, dict[str, float]]:
    """Compute RMSE and fit percent of a simulation of the test experiments, by output; infinite where it grew."""
    y, y_hat = np.concatenate([x.y[dataset.n_init :] for x in dataset.test]), np.concatenate(simulated)
    rmse, fit = {}, {}
    for i, channel in enumerate(dataset.channels.outputs):
        error = math.inf
        if is_finite(y_hat[:, i]):
            error = float(np.sqrt(np.mean((y[:, i] - y_hat[:, i]) ** 2)))
        rmse[channel.name], std = error, spread(y[:, i])
        fit[channel.name] = relative(error, std)["fit_percent"] if std else math.nan
    return {"rmse": rmse, "fit_percent": fit}


def _bounded(error: np.ndarray) -> np.ndarray:
    return np.clip(np.where(np.isnan(error), LARGEST_ERROR, error), -LARGEST_ERROR, LARGEST_ERROR)
