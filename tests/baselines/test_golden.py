"""Figures that are known from elsewhere, on measured data."""

import numpy as np
import pytest

from simgap.baselines.arx import Arx
from simgap.baselines.oe import Oe
from simgap.data import load
from simgap.records import Experiment, TrainingSet


def rmse(model, experiment: Experiment, n_init: int) -> float:
    simulated = model.simulate(experiment.u[None], experiment.y[None, :n_init])[0]
    return float(np.sqrt(np.mean((simulated - experiment.y[n_init:]) ** 2)))


def whole_record(name: str, n_init: int):
    """Training on the complete estimation record, as the published figures do, and the test record."""
    dataset = load(name)
    (train,), (valid,) = dataset.training.train, dataset.training.valid
    record = Experiment("whole", np.vstack((train.u, valid.u)), np.vstack((train.y, valid.y)), train.dt)
    return TrainingSet((record,), (), n_init), dataset.test[0]


@pytest.mark.usefixtures("measured")
def test_wiener_hammerstein_arx_10_10_leaves_43_4_millivolt():
    data, test = whole_record("wiener_hammerstein", 50)
    model = Arx(10, 10, 1)
    model.fit(data, 0)
    assert rmse(model, test, 50) == pytest.approx(0.0434, rel=0.005)


@pytest.mark.usefixtures("measured")
@pytest.mark.parametrize(("n_init", "known"), [(5, 0.588), (50, 0.600)])
def test_tanks_oe_4_4_1_leaves_0_588_volt_from_5_samples(n_init, known):
    data, test = whole_record("cascaded_tanks", 5)
    model = Oe(nb=4, nf=4, nk=1)
    model.fit(data, 0)
    assert rmse(model, test, n_init) == pytest.approx(known, rel=0.005)


@pytest.mark.usefixtures("measured")
@pytest.mark.parametrize(("n_init", "known"), [(5, 0.642), (50, 0.653)])
def test_tanks_arx_4_4_1_leaves_0_642_volt_from_5_samples(n_init, known):
    data, test = whole_record("cascaded_tanks", n_init)
    model = Arx(4, 4, 1)
    model.fit(data, 0)
    assert rmse(model, test, n_init) == pytest.approx(known, rel=0.005)
