"""Results of two models on one data set, one of them broken; a small data set and a small site on disk."""

import math

import pytest
from small_data import dataset  # noqa: F401
from small_site import results_on_disk, site  # noqa: F401

from simgap.records import Result


def _figures(rmse: float, std: float, n: int, **more):
    nrmse = rmse / std
    return {
        "rmse": rmse, "nrmse": nrmse, "fit_percent": 100 * (1 - nrmse), "r2": 1 - nrmse**2, "mse": rmse**2,
        "mae": rmse, "std": std, "n_scored": n, **more,
    }  # fmt: skip


def _row(model, experiment, task, figures, **more):
    return Result(
        model, {}, "tanks", experiment, task, more.pop("seed", 0), more.pop("status", "ok"),
        metrics={"level": figures}, units={"level": "V"}, **more,
    )  # fmt: skip


@pytest.fixture
def make_row():
    """`make_row(model, experiment, rmse, n, seed=...)` is a free run of one output with spread 2 V."""

    def make(model="arx", experiment="test", rmse=1.0, n=100, **more):
        if math.isinf(rmse):
            figures = {"rmse": rmse, "nrmse": rmse, "fit_percent": -rmse, "r2": -rmse, "n_scored": 0}
        else:
            figures = _figures(rmse, 2.0, n)
        return _row(model, experiment, "free_run", figures, **more)

    return make


@pytest.fixture
def results(make_row):
    """`arx` with two test experiments and a forecast, `mean` without a forecast, `gru` broken."""
    ahead = {"1": 0.1, "2": 0.2, "10": 0.5, "50": 0.9, "all": 1.0}
    forecast = _figures(0.4, 2.0, 50, rmse_by_horizon=ahead)
    return [
        make_row("mean", "first", 2.0, n_params=1, fit_seconds=0.001),
        make_row("mean", "second", 2.0, n_params=1, fit_seconds=0.001),
        make_row("arx", "first", 1.0, n_params=4, fit_seconds=0.25),
        make_row("arx", "second", 0.5, n_params=4, fit_seconds=0.25),
        _row("arx", "first", "forecast", forecast, n_params=4, fit_seconds=0.25),
        make_row("gru", "first", math.inf, status="error", message="fit raised MemoryError: [x] (gru.py, line 3)"),
        make_row("gru", "second", math.inf, status="error", message="fit raised MemoryError: [x] (gru.py, line 3)"),
    ]
