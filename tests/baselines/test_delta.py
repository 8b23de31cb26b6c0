"""A model of differences, summed up."""

import numpy as np
import pytest

from simgap.baselines.arx import Arx
from simgap.baselines.delta import Delta
from simgap.records import Experiment, TrainingSet, UnusableInput


def experiment(seed, bias=0.0):
    """An integrator with a leak in its differences: d(k) = 0.5 d(k-1) + u(k-1)."""
    rng = np.random.default_rng(seed)
    u = rng.standard_normal(120)
    d = np.zeros(120)
    for k in range(1, 120):
        d[k] = 0.5 * d[k - 1] + u[k - 1] + bias
    return Experiment(f"e{seed}", u[:, None], np.cumsum(d)[:, None], 0.1)


DATA = TrainingSet((experiment(0), experiment(1)), (experiment(2),), n_init=5)


def test_it_simulates_an_integrator_that_its_inner_model_sees_as_stable():
    model = Delta("arx", {"na": 1, "nb": 1, "nk": 1})
    model.fit(DATA, 0)
    x = experiment(3)
    np.testing.assert_allclose(model.simulate(x.u[None], x.y[None, :5])[0], x.y[5:], atol=1e-8)


def test_its_differences_are_the_simulation_of_the_inner_model():
    model = Delta("arx", {"na": 1, "nb": 1, "nk": 1})
    model.fit(DATA, 0)
    inner = Arx(na=1, nb=1, nk=1)
    differenced = [Experiment(x.name, x.u[1:], np.diff(x.y, axis=0), x.dt) for x in (*DATA.train, *DATA.valid)]
    inner.fit(TrainingSet(tuple(differenced[:2]), tuple(differenced[2:]), n_init=4), 0)
    x = experiment(3)
    simulated = model.simulate(x.u[None], x.y[None, :5])[0]
    expected = inner.simulate(x.u[None, 1:], np.diff(x.y[None, :5], axis=1))[0]
    np.testing.assert_allclose(np.diff(np.vstack((x.y[4:5], simulated)), axis=0), expected, atol=1e-10)


def test_a_constant_error_of_the_differences_becomes_a_drift():
    model = Delta("arx", {"na": 1, "nb": 1, "nk": 1})
    model.fit(DATA, 0)
    x = experiment(3, bias=0.1)
    error = x.y[5:, 0] - model.simulate(x.u[None], x.y[None, :5])[0, :, 0]
    assert error[-1] == pytest.approx(0.2 * len(error), rel=0.05)


def test_it_needs_two_measured_samples():
    with pytest.raises(UnusableInput, match="at least two measured samples"):
        Delta().fit(TrainingSet(DATA.train, (), n_init=1), 0)
