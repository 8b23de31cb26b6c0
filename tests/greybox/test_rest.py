"""What inputs and simulation tell of the errors of a model, and that noise is not taken for it."""

from dataclasses import replace

import numpy as np
import pytest
from grey_boxes import plain_grey_box
from scipy.signal import lfilter

from simgap.data.simulated.rigs import hide
from simgap.greybox.model import GreyBoxModel
from simgap.greybox.rest import MEMORIES, folds, learn


def predicted(model, rest, dataset):
    """The share of the squared errors of the free runs of the test experiments."""
    n, before, after = dataset.n_init, 0.0, 0.0
    for x in dataset.test:
        y_hat = model.simulate_whole(x.u[None], x.y[None, :n])
        error = (x.y - y_hat[0])[n:]
        before += np.sum(error**2)
        after += np.sum((error - rest.predict(x.u[None], y_hat)[0, n:]) ** 2)
    return 1 - after / before


@pytest.fixture(scope="module")
def clean():
    return plain_grey_box(hide("cart", {}, noise=0.05, seed=1).training)


@pytest.mark.parametrize("colour", [0.0, 0.9, 0.98])
def test_of_noise_nothing_is_learnt(clean, colour):
    (plant,), learnt = clean.plants, []
    for seed in range(6):
        noise = np.random.default_rng(seed).standard_normal(plant.estimate.errors.shape)
        errors = lfilter([1], [1, -colour], noise, axis=1)
        learnt.append(learn(GreyBoxModel([replace(plant, estimate=replace(plant.estimate, errors=errors))]), seed))
    assert [rest.outputs for rest in learnt] == [(None,)] * 6


@pytest.mark.parametrize(
    ("rig", "effect"), [("stage", "negative_damping"), ("cart", "coulomb_friction"), ("stage", "backlash")]
)
def test_most_of_a_cause_that_the_model_lacks_is_learnt(rig, effect):
    dataset = hide(rig, {effect: 1.0}, noise=0.05, seed=2)
    model = plain_grey_box(dataset.training)
    rest = learn(model, 0)
    assert rest.outputs[0].share > 0.4
    assert predicted(model, rest, dataset) > 0.4


def test_what_no_input_shows_is_not_learnt():
    model = plain_grey_box(hide("stage", {"missing_input": 1.0}, noise=0.05, seed=3).training)
    assert learn(model, 0).outputs == (None,)


def test_a_prediction_is_never_larger_than_the_largest_error_in_training():
    dataset = hide("cart", {"dead_zone": 1.0}, noise=0.05, seed=4)
    model = plain_grey_box(dataset.training)
    far = 1e6 * dataset.test[0].u[None]
    y_hat = model.simulate_whole(far, dataset.test[0].y[None, :20])
    largest = np.abs(model.plants[0].estimate.errors).max()
    assert np.abs(learn(model, 0).predict(far, y_hat)).max() <= largest


def test_the_unit_of_the_output_changes_nothing():
    dataset = hide("cart", {"dead_zone": 1.0}, noise=0.05, seed=4)
    model = plain_grey_box(dataset.training)
    (plant,) = model.plants
    share = learn(model, 0).outputs[0].share
    errors = replace(plant, estimate=replace(plant.estimate, errors=1e-2 * plant.estimate.errors))
    assert learn(GreyBoxModel([errors]), 0).outputs[0].share == pytest.approx(share, rel=1e-6)


def test_a_fold_of_one_long_record_lasts_longer_than_the_memory_of_the_error():
    e = lfilter([1], [1, -0.98], np.random.default_rng(5).standard_normal(4000))[None, :, None]
    fold = folds(e, np.ones((1, 4000), dtype=bool))[0]
    changes = np.flatnonzero(np.diff(fold))
    assert 2 <= len(changes) < 16
    tau = 1.98 / 0.02  # of an autoregression of first order
    assert np.diff([-1, *changes, 3999]).min() > 0.5 * MEMORIES * tau
