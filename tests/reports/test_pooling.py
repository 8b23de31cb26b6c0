"""Forecasts pooled over test experiments: those that are long enough, and all or none of a model that failed."""

import math
from dataclasses import replace

import pytest

from simgap.reports.pooling import standings
from simgap.reports.site.fit_charts import horizon_charts


def forecast(row, n, **ahead):
    figures = next(iter(row.metrics.values())) | {
        "n_scored": n,
        "rmse_by_horizon": {k[1:]: v for k, v in ahead.items()},
    }
    return replace(row, task="forecast", metrics=dict.fromkeys(row.metrics, figures))


@pytest.fixture
def output(make_row):
    return next(iter(make_row().metrics))


def test_an_experiment_that_is_too_short_for_a_horizon_does_not_count_there(make_row, output):
    rows = [
        forecast(make_row(experiment="long"), 100, h1=1.0, h50=2.0),
        forecast(make_row(experiment="short"), 100, h1=3.0),
    ]
    standing = standings(rows)[0]
    assert standing.rmse_at(output, "50").median == pytest.approx(2.0)
    assert standing.rmse_at(output, "1").median == pytest.approx(math.sqrt(5.0))


def test_a_model_that_failed_on_one_experiment_has_no_forecast_of_all(make_row, output):
    failed = replace(make_row(experiment="second", rmse=math.inf, status="error"), task="forecast")
    standing = standings([forecast(make_row(experiment="first"), 100, h1=1.0), failed])[0]
    assert standing.rmse_at(output, "1").median == math.inf


def test_the_free_run_beside_the_horizons_is_that_of_the_tables(make_row, output):
    free = [make_row(experiment="long", rmse=1.0, n=900), make_row(experiment="short", rmse=3.0, n=100)]
    rows = [*free, *(forecast(row, 50, h1=0.1, h2=0.2) for row in free)]
    chart = horizon_charts(standings(rows)[0])[0]
    assert "1.34 V in the free run" in chart["about"]  # sqrt(0.9 1^2 + 0.1 3^2), not the mean of the two
