"""A mean of several simulations, each with a weight."""

from dataclasses import replace

import numpy as np
import pytest

from simgap.baselines.arx import Arx
from simgap.baselines.ensemble import Ensemble
from simgap.baselines.mean import Mean
from simgap.protocol import is_stochastic
from simgap.records import Experiment, TrainingSet, UnusableInput


def experiment(seed):
    rng = np.random.default_rng(seed)
    u, y = rng.standard_normal(200), np.zeros(200)
    for k in range(1, 200):
        y[k] = 0.8 * y[k - 1] + u[k - 1]
    return Experiment(f"e{seed}", u[:, None], (y + 0.2 * rng.standard_normal(200))[:, None], 0.1)


DATA = TrainingSet((experiment(0), experiment(1)), (experiment(2),), n_init=5)


def errors_of(model, x):
    """The error before the model is estimated on x too."""
    model.fit(replace(DATA, valid=()), 0)
    return np.mean((model.simulate(x.u[None], x.y[None, :5])[0] - x.y[5:]) ** 2)


def test_weights_are_inverse_to_the_mean_squared_errors_of_held_out_free_runs():
    model = Ensemble(models=("arx", "mean"))
    model.fit(DATA, 0)
    arx, mean = (errors_of(kind, DATA.valid[0]) for kind in (Arx(na=1, nb=1, nk=1), Mean()))
    np.testing.assert_allclose(model.weights, np.array([1 / arx, 1 / mean]) / (1 / arx + 1 / mean))


def test_its_simulation_is_the_weighted_mean():
    model, x = Ensemble(models=("arx", "mean")), experiment(3)
    model.fit(DATA, 0)
    single = [kind.simulate(x.u[None], x.y[None, :5]) for kind in model.members]
    expected = model.weights[0] * single[0] + model.weights[1] * single[1]
    np.testing.assert_allclose(model.simulate(x.u[None], x.y[None, :5]), expected)


def test_a_model_that_is_named_twice_has_two_seeds_and_another_seed_gives_others():
    model = Ensemble(models=("arx", "gru", "gru"), epochs=1, batches=1)
    model.fit(DATA, 0)
    first = model.weights
    assert len(set(first)) == 3
    assert is_stochastic(model)
    model.fit(DATA, 1)
    assert not set(first) & set(model.weights)


class Runaway:
    """Simulates nothing that is a number."""

    def fit(self, data, seed):
        pass

    def simulate(self, u, y_init):
        return np.full((len(u), u.shape[1] - y_init.shape[1], y_init.shape[2]), np.nan)


def test_a_member_that_runs_away_has_no_weight(monkeypatch):
    from simgap.registry import MODELS

    monkeypatch.setitem(MODELS._targets, "runaway", Runaway)
    model, x = Ensemble(models=("arx", "runaway")), experiment(3)
    model.fit(DATA, 0)
    assert list(model.weights) == [1, 0]
    assert np.isfinite(model.simulate(x.u[None], x.y[None, :5])).all()
    with pytest.raises(UnusableInput, match="no member"):
        Ensemble(models=("runaway",)).fit(DATA, 0)


def test_it_needs_a_model():
    with pytest.raises(UnusableInput, match="at least one model"):
        Ensemble(models=()).fit(DATA, 0)
