"""What is learnt beside a grey box, step by step: every design of features, and the network of long records."""

import numpy as np
import pytest
from plants_without_a_fit import grey_box, record

from simgap.baselines.estimation.filter_network import FilterNetwork, _drawn
from simgap.exports.grey_boxes import GreyBoxStep
from simgap.exports.rests import GreyBoxWithRest
from simgap.exports.subjects import has_step
from simgap.greybox.rest import DESIGNS, Rest, RestOfOutput
from simgap.greybox.rest_features import Features, denominator_of
from simgap.registry import MODELS


def step_and_whole(plant, of_output):
    """The step of a grey box with a rest at its first output, and the simulation with what the rest predicts."""
    u, y_init = record(plant)
    model = grey_box(plant)
    rest = Rest((of_output(model, u, y_init), *[None] * (y_init.shape[1] - 1)))
    step = GreyBoxWithRest(model, rest, 1, y_init.shape[1])
    y = model.simulate_whole(u[None], y_init[None])
    whole = (y + rest.predict(u[None], y))[0, len(y_init) :]
    return step.form.run(u[len(y_init) :], step.start(u, y_init)), whole, y[0, len(y_init) :]


@pytest.mark.parametrize("design", DESIGNS, ids=str)
@pytest.mark.parametrize("plant", ["position", "two outputs", "tanks"])
def test_every_design_of_features_predicts_the_same(design, plant):
    def of_output(model, u, y_init):
        fitted = model.plants[0]
        y = model.simulate_whole(u[None], y_init[None])
        mask = np.ones(y.shape[:2], dtype=bool)
        denominator = denominator_of(fitted.estimate.plant, fitted.estimate.theta, len(u))
        features = Features.draw(design, u[None], y, mask, denominator, seed=0)
        width = sum(block.shape[2] for block in features.blocks(u[None], y))
        rng = np.random.default_rng(1)
        coefficients = rng.normal(size=width) / width
        return RestOfOutput(features, rng.normal(size=width), coefficients, 0.5, 0.2)

    stepped, whole, without = step_and_whole(plant, of_output)
    np.testing.assert_allclose(stepped, whole, atol=1e-10 * np.std(whole))
    assert np.max(np.abs(whole - without)) > 1e-3, "the rest does nothing"


def test_the_network_of_long_records_predicts_the_same():
    def of_output(model, u, y_init):
        weights = tuple(_drawn(2, 0))
        return FilterNetwork(np.zeros(2), np.array([1.0, 0.5]), weights, 0.3, 1.0, 0.5)

    stepped, whole, without = step_and_whole("position", of_output)
    np.testing.assert_allclose(stepped, whole, atol=1e-9 * np.std(whole))
    assert np.max(np.abs(whole - without)) > 1e-3, "the rest does nothing"


def test_hybrid_says_what_it_consists_of():
    assert has_step(MODELS["hybrid"])
    assert GreyBoxStep(grey_box("position"), 1, 1).form.direct is False
