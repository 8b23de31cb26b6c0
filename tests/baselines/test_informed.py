"""A black-box model with what physical effects do as further inputs."""

from dataclasses import replace

import numpy as np

from simgap.baselines.informed import Informed
from simgap.data.simulated.rigs import hide


def informed_by(data):
    model = Informed(effects=("coulomb_friction",))
    model.fit(data, 0)
    return model


def test_the_model_as_chosen_is_not_estimated_on_validation_data():
    data = hide("stage", {"coulomb_friction": 1.0}, seed=3)
    training, (x, *_) = data.training, data.test
    u, y_init = x.u[None], x.y[None, : data.n_init]
    once, twice = informed_by(training), informed_by(replace(training, valid=2 * training.valid))
    np.testing.assert_array_equal(once.as_chosen().simulate(u, y_init), twice.as_chosen().simulate(u, y_init))


def test_friction_that_is_simulated_beside_a_linear_model_halves_its_error():
    data = hide("stage", {"coulomb_friction": 1.0}, seed=3)
    model, (x, *_) = informed_by(data.training), data.test
    effects = Informed(effects=())
    effects.fit(data.training, 0)
    errors = [np.std(m.simulate(x.u[None], x.y[None, : data.n_init])[0] - x.y[data.n_init :]) for m in (model, effects)]
    assert errors[0] < 0.5 * errors[1]
