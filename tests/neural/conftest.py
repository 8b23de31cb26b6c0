"""Small data for networks."""

import numpy as np
import pytest

from simgap.records import Experiment, TrainingSet


def experiment(seed, length=120):
    """A first-order lag under white noise."""
    u = np.random.default_rng(seed).standard_normal((length, 1))
    y = np.convolve(u[:, 0], 0.3 * 0.7 ** np.arange(20))[:length, None]
    return Experiment(f"e{seed}", u, y, 0.1)


@pytest.fixture(scope="session")
def data():
    """Two experiments to train on and one to validate on."""
    return TrainingSet((experiment(0), experiment(1)), (experiment(2),), n_init=10)


@pytest.fixture(scope="session")
def simulated():
    """A model's free run of a further experiment."""
    x = experiment(3)
    return lambda model: model.simulate(x.u[None], x.y[None, :10])
