"""A mean of several simulations, each with a weight."""

import numpy as np
import pytest

from simgap.baselines.ensemble import Ensemble
from simgap.baselines.estimation.stacking import cross_validated, stacked
from simgap.protocol import is_stochastic
from simgap.records import Experiment, TrainingSet, UnusableInput
from simgap.registry import MODELS
from simgap.running.fitting import validation_error


def experiment(seed):
    rng = np.random.default_rng(seed)
    u, y = rng.standard_normal(200), np.zeros(200)
    for k in range(1, 200):
        y[k] = 0.8 * y[k - 1] + u[k - 1]
    return Experiment(f"e{seed}", u[:, None], (y + 0.2 * rng.standard_normal(200))[:, None], 0.1)


DATA = TrainingSet((experiment(0), experiment(1)), (experiment(2),), n_init=5)


def test_the_runs_of_one_model_are_weighed_by_their_errors_and_models_by_least_squares():
    rng = np.random.default_rng(0)
    target = rng.standard_normal((400, 1))
    bias, noise = rng.standard_normal((400, 1)), rng.standard_normal((3, 400, 1))
    runs = np.array([target + bias + 0.1 * noise[0], target + bias + 0.2 * noise[1], target + noise[2]])
    weights = stacked(("a", "a", "b"), runs, target)
    of_a, of_b = np.square(runs - target).mean(axis=(1, 2))[:2], weights[2]
    assert weights.sum() == pytest.approx(1.0)
    assert weights[0] / weights[1] == pytest.approx(of_a[1] / of_a[0])
    mean = (weights[0] * runs[0] + weights[1] * runs[1]) / (weights[0] + weights[1])
    errors = np.stack([(mean - target).ravel(), (runs[2] - target).ravel()])
    products = errors @ errors.T
    least = (products[0, 0] - products[0, 1]) / (products[0, 0] + products[1, 1] - 2 * products[0, 1])
    assert of_b == pytest.approx(least, rel=1e-4)


def test_a_model_that_only_adds_to_the_error_of_another_has_no_weight():
    rng = np.random.default_rng(1)
    target, error = rng.standard_normal((2, 400, 1))
    weights = stacked(("good", "bad"), np.array([target + 0.1 * error, target + error]), target)
    np.testing.assert_allclose(weights, [1.0, 0.0], atol=1e-9)


def slow_noise(rng, count, n=4000, memory=0.97):
    """Errors that remember about sixty samples, of variance 1."""
    e = rng.standard_normal((count, n, 1)) * np.sqrt(1 - memory**2)
    for k in range(1, n):
        e[:, k] += memory * e[:, k - 1]
    return e


def test_the_error_on_validation_data_is_what_the_same_weights_err_by_on_new_data():
    names, target, squares = ("a", "b", "c", "d", "e", "f"), np.zeros((4000, 1)), []
    for seed in range(30):
        runs = slow_noise(np.random.default_rng(seed), 6)
        weights = stacked(names, runs[:, :400], target[:400])
        of_mean = np.square(np.tensordot(weights, runs, 1))
        held_out = cross_validated(names, runs[:, :400], target[:400])
        squares.append((held_out**2, of_mean[:400].mean(), of_mean[600:].mean()))
    held_out, same_data, new_data = np.sqrt(np.mean(squares, axis=0))
    assert same_data < 0.75 * new_data  # the weights were estimated on the samples that judge them
    assert held_out == pytest.approx(new_data, rel=0.15)


def test_an_ensemble_of_one_model_errs_on_validation_data_as_that_does():
    one, arx = Ensemble(models=("arx",)), MODELS["arx"]()
    one.fit(DATA, 0)
    arx.fit(DATA, 0)
    assert validation_error(one, DATA) == pytest.approx(validation_error(arx, DATA))


def test_the_error_of_an_ensemble_on_few_samples_is_that_of_the_plain_mean():
    runs, target = np.array([[[1.0], [2.0]], [[3.0], [4.0]], [[np.nan], [0.0]]]), np.array([[2.5], [2.5]])
    assert cross_validated(("a", "b", "c"), runs, target) == pytest.approx(np.sqrt(0.25))


def test_its_simulation_is_the_weighted_mean():
    model, x = Ensemble(models=("arx", "mean")), experiment(3)
    model.fit(DATA, 0)
    single = [kind.simulate(x.u[None], x.y[None, :5]) for kind in model.members]
    expected = model.weights[0] * single[0] + model.weights[1] * single[1]
    np.testing.assert_allclose(model.simulate(x.u[None], x.y[None, :5]), expected)


def test_a_model_that_is_named_twice_has_two_seeds_and_another_seed_gives_others():
    model = Ensemble(models=("gru", "gru"), epochs=1, batches=1)
    model.fit(DATA, 0)
    first = model.weights
    assert len(set(first)) == 2
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
