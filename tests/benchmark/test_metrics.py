import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from simgap.metrics import failed_metrics, pool, score, score_outputs
from simgap.records import Channels

values = st.floats(-1e99, 1e99)
signals = arrays(np.float64, st.integers(1, 30), elements=values)


@given(st.data(), signals)
def test_the_identities_between_the_figures_hold(data, y):
    y_hat = data.draw(arrays(np.float64, len(y), elements=values))
    figures = score(y, y_hat)
    assert figures["r2"] == 1 - figures["nrmse"] * figures["nrmse"]
    assert figures["fit_percent"] == 100 * (1 - figures["nrmse"])
    assert figures["rmse"] == math.sqrt(figures["mse"])
    assert figures["mae"] <= figures["rmse"] * (1 + 1e-9) or figures["rmse"] < 1e-150
    assert not any(math.isnan(figure) for figure in figures.values())
    if 0 < figures["std"] < math.inf:
        assert figures["nrmse"] == figures["rmse"] / figures["std"]


@given(signals, st.sampled_from([np.nan, np.inf, -np.inf, 1e200]))
def test_a_simulation_that_is_not_finite_has_infinite_errors(y, bad):
    y_hat = y.copy()
    y_hat[-1] = bad
    figures = score(y, y_hat)
    assert figures["rmse"] == figures["nrmse"] == figures["mse"] == figures["mae"] == math.inf
    assert figures["fit_percent"] == figures["r2"] == -math.inf


def test_a_simulation_as_good_as_the_mean_has_a_fit_of_zero():
    y = np.array([1.0, 2.0, 3.0])
    figures = score(y, np.full(3, 2.0))
    assert figures["nrmse"] == 1
    assert figures["fit_percent"] == figures["r2"] == 0
    assert figures["n_scored"] == 3


def test_a_constant_output_is_fitted_exactly_or_not_at_all():
    constant = np.full(7, 0.1)
    assert score(constant, constant)["nrmse"] == 0
    assert score(constant, constant + 1e-9)["nrmse"] == math.inf


def test_outputs_are_scored_one_by_one_under_their_names():
    y = np.array([[0.0, 0.0], [2.0, 4.0]])
    figures = score_outputs(y, y + np.array([1.0, 2.0]), Channels.unnamed(1, 2))
    assert {name: entry["rmse"] for name, entry in figures.items()} == {"y0": 1, "y1": 2}


def test_pooling_records_gives_the_rmse_of_the_joined_record():
    rng = np.random.default_rng(0)
    errors = [rng.normal(size=n) for n in (5, 50, 500)]
    rmse = [math.sqrt(np.mean(e**2)) for e in errors]
    assert pool(rmse, [5, 50, 500]) == pytest.approx(math.sqrt(np.mean(np.concatenate(errors) ** 2)))
    assert pool([math.inf], [0]) == math.inf


def test_a_failed_model_has_infinite_errors_over_no_samples():
    (figures,) = failed_metrics(Channels.unnamed(1, 1)).values()
    assert (figures["rmse"], figures["fit_percent"], figures["n_scored"]) == (math.inf, -math.inf, 0)
