"""How far a simulation is from the measurement, per output and in the output's own unit."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.records import LARGEST_VALUE, Channels, Experiment


def score(y: Float[np.ndarray, " n"], y_hat: Float[np.ndarray, " n"]) -> dict[str, Any]:
    """Errors of the simulated samples y_hat against the measured samples y of one output.

    rmse, mae, std [unit of y], mse [unit squared]; nrmse = rmse / std with the population std of y;
    fit_percent = 100 (1 - nrmse); r2 = 1 - nrmse^2. A simulation that is not finite has infinite errors.
    Where y is constant, nrmse is 0 for an exact simulation, else infinite. No figure is ever NaN.
    """
    std = spread(y)
    if is_finite(y_hat):
        error = y_hat - y
        mse, mae = float(np.mean(error * error)), float(np.mean(np.abs(error)))
    else:
        mse = mae = math.inf
    rmse = math.sqrt(mse)
    return {"rmse": rmse, **relative(rmse, std), "mse": mse, "mae": mae, "std": std, "n_scored": len(y)}


def relative(rmse: float, std: float) -> dict[str, float]:
    """nrmse, fit_percent and r2 of an error `rmse` in a signal of spread `std`, both in one unit."""
    if std > 0:
        nrmse = rmse / std
    elif rmse == 0:
        nrmse = 0.0
    else:
        nrmse = math.inf
    return {"nrmse": nrmse, "fit_percent": 100 * (1 - nrmse), "r2": 1 - nrmse * nrmse}


def score_outputs(
    y: Float[np.ndarray, "n ny"], y_hat: Float[np.ndarray, "n ny"], channels: Channels
) -> dict[str, dict[str, Any]]:
    """`score` of every output, by the output's name."""
    return {channel.name: score(y[:, i], y_hat[:, i]) for i, channel in enumerate(channels.outputs)}


def failed_metrics(channels: Channels) -> dict[str, dict[str, Any]]:
    """The figures of a model that simulated nothing: infinite errors over zero samples."""
    infinite = {"rmse": math.inf, "nrmse": math.inf, "fit_percent": -math.inf, "r2": -math.inf}
    return {c.name: infinite | {"mse": math.inf, "mae": math.inf, "n_scored": 0} for c in channels.outputs}


def free_runs(
    simulate: Callable[..., np.ndarray], experiments: Sequence[Experiment], n_init: int
) -> tuple[Float[np.ndarray, "N ny"], Float[np.ndarray, "N ny"]]:
    """Return simulated and measured outputs, over their sizes, after the first n_init samples of all experiments.

    The size of an output is its spread over all of them; experiments that are no longer than n_init are left out.
    """
    longer = [x for x in experiments if len(x) > n_init]
    measured = np.concatenate([x.y[n_init:] for x in longer])
    size = np.array([spread(of_output) or 1.0 for of_output in measured.T])
    with np.errstate(over="ignore", invalid="ignore"):
        simulated = np.concatenate([simulate(x.u[None], x.y[None, :n_init])[0] for x in longer])
        return simulated / size, measured / size


def free_run_nrmse(simulate: Callable[..., np.ndarray], experiments: Sequence[Experiment], n_init: int) -> float:
    """sqrt(mean over the outputs of mse / variance) of free runs from n_init measured samples; inf if one diverges."""
    simulated, measured = free_runs(simulate, experiments, n_init)
    with np.errstate(over="ignore", invalid="ignore"):
        nrmse = float(np.sqrt(np.mean(np.square(simulated - measured))))
    return nrmse if np.isfinite(nrmse) else math.inf


def pool(values: Iterable[float], samples: Iterable[int]) -> float:
    """One RMSE or spread for several records: sqrt(sum n v^2 / sum n)."""
    pairs = [(value, n) for value, n in zip(values, samples, strict=True) if n > 0]
    total = sum(n for _, n in pairs)
    return math.sqrt(sum(n * value * value for value, n in pairs) / total) if total else math.inf


def is_finite(values: np.ndarray) -> bool:
    """Whether every value could be a measurement; what is larger counts as infinite."""
    return bool(values.min() >= -LARGEST_VALUE and values.max() <= LARGEST_VALUE)


def spread(y: Float[np.ndarray, " n"]) -> float:
    """Population standard deviation; exactly 0 for constant samples, where rounding would leave a little."""
    return 0.0 if np.ptp(y) == 0 else float(np.std(y))
