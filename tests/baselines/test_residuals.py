"""Residual analysis: right bounds where the model is right, and a finding where it is not."""

import numpy as np
import pytest
from scipy.signal import lfilter

from simgap.baselines.arx import Arx
from simgap.baselines.estimation import residuals
from simgap.baselines.estimation.residuals import residual_analysis
from simgap.baselines.oe import Oe
from simgap.records import Experiment, TrainingSet


def experiment(rng, length=500, numerator=(0, 1.0), noise_filter=(1.0,), smooth=0.0):
    u = lfilter([1], [1, -smooth], rng.standard_normal(length))
    y = lfilter(numerator, [1, -0.8], u) + 0.3 * lfilter([1.0], noise_filter, rng.standard_normal(length))
    return Experiment("e", u[:, None], y[:, None], 1.0)


def rate_outside(correlations):
    return np.mean([len(c.outside) / len(c.lags) for c in correlations])


@pytest.mark.parametrize("smooth", [0.0, 0.9])
def test_one_lag_in_twenty_is_outside_when_the_arx_model_is_right(smooth):
    rng = np.random.default_rng(0)
    own, cross = [], []
    for _ in range(80):
        model = Arx(1, 1)
        data = tuple(experiment(rng, noise_filter=(1, -0.8), smooth=smooth) for _ in range(2))
        model.fit(TrainingSet(data, (), 5), 0)
        ((past, with_input),) = residual_analysis(model.result, data, ["voltage"], max_lag=15)
        own.append(past)
        cross.append(with_input)
    assert 0.03 < rate_outside(own) < 0.07
    assert 0.025 < rate_outside(cross) < 0.075


def test_coloured_noise_and_a_coloured_input_raise_no_false_alarm():
    rng = np.random.default_rng(1)
    cross, plain = [], []
    for _ in range(30):
        data = (experiment(rng, 1500, noise_filter=(1, -0.9), smooth=0.9),)
        model = Oe(1, 1, start="free")
        model.fit(TrainingSet(data, (), 5), 0)
        ((_, with_input),) = residual_analysis(model.result, data, ["voltage"], max_lag=15)
        cross.append(with_input)
        plain.append(np.mean(np.abs(with_input.values) > 1.96 / np.sqrt(1500)))
    assert rate_outside(cross) < 0.10
    assert np.mean(plain) > 0.15  # the usual bounds would blame a model that is right


def test_missing_dynamics_show_at_their_lag():
    rng = np.random.default_rng(2)
    data = (experiment(rng, 2000, numerator=(0, 1.0, 0, 0, 0, 0.3)),)
    model = Arx(1, 1)
    model.fit(TrainingSet(data, (), 5), 0)
    ((_, with_input),) = residual_analysis(model.result, data, ["voltage"])
    assert 5 in with_input.outside
    assert "residual with voltage" in with_input.text()


def test_feedback_shows_at_negative_lags():
    rng = np.random.default_rng(3)
    u, y = np.zeros((3000, 1)), np.zeros((3000, 1))
    e = rng.standard_normal(3000)
    for t in range(1, 3000):
        y[t] = 0.8 * y[t - 1] + u[t - 1] + e[t]
        u[t] = rng.standard_normal() - 0.5 * y[t]
    model = Arx(1, 1)
    data = (Experiment("e", u, y, 1.0),)
    model.fit(TrainingSet(data, (), 5), 0)
    ((_, with_input),) = residual_analysis(model.result, data, ["voltage"])
    assert (with_input.outside < 0).sum() >= 1
    assert 0 in with_input.outside  # u(t) answers to e(t) at once


@pytest.mark.parametrize("length", [8, 12, 40, 100])
def test_a_short_record_is_asked_for_fewer_lags(length):
    rng = np.random.default_rng(4)
    data = (experiment(rng, length),)
    model = Arx(1, 1)
    model.fit(TrainingSet(data, (), 2), 0)
    (found,) = residual_analysis(model.result, data, ["voltage"])
    assert all(np.isfinite(c.values).all() and c.lags.max() <= max(1, length // 5) for c in found)
    assert "residual standard deviation" in model.summary()


def test_more_experiments_than_are_needed_are_left_out(monkeypatch):
    monkeypatch.setattr(residuals, "ENOUGH_SAMPLES", 510)  # the third experiment of 199 is more than enough
    rng = np.random.default_rng(5)
    data = tuple(experiment(rng, 200) for _ in range(6))
    model = Arx(1, 1)
    model.fit(TrainingSet(data, (), 5), 0)
    ((past, _),) = residual_analysis(model.result, data, ["voltage"])
    ((same, _),) = residual_analysis(model.result, data[:3], ["voltage"])
    np.testing.assert_array_equal(past.values, same.values)
