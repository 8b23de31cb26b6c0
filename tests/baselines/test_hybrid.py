"""The grey box with a learnt rest: never much worse than the grey box, and blind to the test split."""

from dataclasses import replace

import numpy as np
import pytest
from grey_boxes import plain_grey_box
from scipy.signal import lfilter

from simgap.baselines.estimation import filter_network
from simgap.baselines.greybox_auto import GreyBoxAuto
from simgap.baselines.hybrid import Hybrid
from simgap.data.simulated.rigs import hide
from simgap.records import Experiment
from simgap.running.fitting import fit


def mse(model, dataset):
    n = dataset.n_init
    return np.mean([np.mean((model.simulate(x.u[None], x.y[None, :n])[0] - x.y[n:]) ** 2) for x in dataset.test])


@pytest.fixture
def named_nothing(monkeypatch):
    """A grey box that finds no effects, and is there at once."""

    def fit(self, data, seed):
        self.plants = plain_grey_box(data).plants

    monkeypatch.setattr(GreyBoxAuto, "fit", fit)


@pytest.fixture(scope="module")
def outside():
    return hide("stage", {"position_dependent_gain": 1.0}, noise=0.05, seed=3)


@pytest.fixture
def fitted(outside, named_nothing):
    model = Hybrid()
    model.fit(outside.training, 0)
    return model


def test_it_simulates_better_than_the_grey_box_what_no_effect_explains(outside, fitted):
    assert mse(fitted, outside) < 0.8 * mse(fitted.grey, outside)
    assert fitted.fitted["learnt"][0] > 0.2


def test_where_nothing_is_left_it_is_the_grey_box(named_nothing):
    dataset = hide("cart", {}, noise=0.05, seed=4)
    model = Hybrid()
    model.fit(dataset.training, 0)
    assert model.rest.outputs == (None,)
    assert mse(model, dataset) == mse(model.grey, dataset)


def test_garbage_in_the_test_split_changes_nothing_of_the_fit(outside, fitted):
    rng = np.random.default_rng(0)
    garbage = tuple(
        Experiment(x.name, rng.permutation(x.u), rng.standard_normal(x.y.shape), x.dt) for x in outside.test
    )
    other = fit("hybrid", replace(outside, test=garbage)).model
    assert mse(other, outside) == mse(fitted, outside)


@pytest.fixture(scope="module")
def filtered():
    """A curve between two filters, its input, and a network that was trained on it."""
    u = np.random.default_rng(1).standard_normal((3, 1500, 1))
    e = lfilter([0.5], [1, -0.5], np.tanh(2 * lfilter([1, 0.5], [1, -0.6], u[..., 0], axis=1)), axis=1)
    mask, held_out = np.ones(e.shape, dtype=bool), np.array([False, False, True])
    return u, e, filter_network.train(u, np.zeros_like(u), e, mask, held_out, 0)


def test_a_network_of_filters_learns_a_curve_between_two_filters(filtered):
    u, e, network = filtered
    assert network.share > 0.95
    assert 1 - np.mean((network.predict(u, np.zeros_like(u)) - e)[2] ** 2) / np.var(e[2]) > 0.95


def test_a_network_of_filters_does_not_look_ahead(filtered):
    u, _, network = filtered
    later = u.copy()
    later[:, 700:] += 1.0
    before, after = (network.predict(given, np.zeros_like(u)) for given in (u, later))
    assert np.allclose(before[:, :700], after[:, :700], rtol=0, atol=1e-12)
    assert np.abs(before - after).max() > 0.1
