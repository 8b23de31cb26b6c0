"""Readings in steps: their slope is zero or infinite, and all else of the model is to be fitted nevertheless."""

from dataclasses import replace

import numpy as np
import pytest

from simgap.data.simulated.rigs import hide, physical
from simgap.greybox.intervals import intervals
from simgap.registry import MODELS


@pytest.mark.parametrize("steps_per_spread", [10, 3])
def test_beside_readings_in_steps_a_friction_is_estimated_with_its_range(steps_per_spread):
    training = hide("cart", {"coulomb_friction": 1.0}, noise=0.02, seed=7).training
    step = np.std(np.concatenate([experiment.y for experiment in training.train])) / steps_per_spread
    train, valid = (
        tuple(replace(experiment, y=step * np.round(experiment.y / step)) for experiment in experiments)
        for experiments in (training.train, training.valid)
    )
    model = MODELS["greybox"](effects=("coulomb_friction", "quantisation"))
    model.fit(replace(training, train=train, valid=valid), 0)
    fitted = model.plants[0]
    plant = fitted.estimate.plant
    [friction] = [term for term in plant.terms if term.effect.name == "coulomb_friction"]
    at = plant.part_of(friction).start
    low, high = (ends[at] for ends in intervals(fitted))
    assert low < high < 1.3 * low
    assert fitted.estimate.theta[at] == pytest.approx(
        physical("cart", {"coulomb_friction": 1.0})["coulomb_friction"], rel=0.05
    )
