"""Readings in steps: their slope is zero or infinite, and all else of the model is to be fitted nevertheless."""

import math
from dataclasses import replace

import numpy as np
import pytest

from simgap.data.simulated.rigs import hide, physical
from simgap.greybox.intervals import intervals
from simgap.greybox.noise import log_likelihood
from simgap.registry import MODELS

from .parts import records


@pytest.mark.parametrize(("steps_per_spread", "noise"), [(10, 0.02), (3, 0.02), (3, 0.0)])
def test_beside_readings_in_steps_a_friction_is_estimated_with_its_range(steps_per_spread, noise):
    training = hide("cart", {"coulomb_friction": 1.0}, noise=noise, seed=7).training
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
    assert low < physical("cart", {"coulomb_friction": 1.0})["coulomb_friction"] < high < 1.3 * low


@pytest.mark.parametrize("wrong", [0, 3])
def test_no_model_takes_a_coarse_reading_for_likelier_than_certain(wrong):
    step, n = 0.5, 400
    y = step * np.round(np.random.default_rng(0).normal(size=(1, n, 1)) / step)
    readings = records(np.zeros((1, n)), y, 0.1)
    errors = np.zeros_like(y)
    errors[0, :wrong] = step
    likely = log_likelihood(errors, readings.mask, 0, readings.resolution) - n / 2 * math.log(2 * math.pi * math.e)
    assert likely + n * math.log(step) == pytest.approx(0.0, abs=1e-6)  # the chance of a reading is density times step
