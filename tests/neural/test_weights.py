"""A network that was saved comes back as it was, in both modes, and only with weights that are its own."""

import numpy as np
import pytest

from simgap.neural.gru import GRU
from simgap.neural.training.network import Network
from simgap.records import UnusableInput
from simgap.registry import MODELS

NETWORKS = [name for name in MODELS if isinstance(MODELS[name], type) and issubclass(MODELS[name], Network)]


@pytest.mark.parametrize("mode", [pytest.param("windowed", marks=pytest.mark.slow), "stateful"])
@pytest.mark.parametrize("name", NETWORKS)
def test_a_network_that_was_saved_simulates_the_same(name, mode, data, simulated):
    model = MODELS[name](mode=mode, window=16, epochs=1, batches=2)
    model.fit(data, 0)
    loaded = MODELS[name].from_saved(model.saved_state())
    np.testing.assert_array_equal(simulated(loaded), simulated(model))
    assert loaded.n_params == model.n_params
    assert loaded.fitted["epochs"] == 1


@pytest.fixture(scope="module")
def state(data):
    model = GRU(epochs=1, batches=1, units=4)
    model.fit(data, 0)
    return model.saved_state()


@pytest.mark.parametrize(
    "spoiled",
    [
        {"units": 10**9},
        {"units": 5},
        {"units": -1},
        {"unheard": 1},
        {"mode": "sideways"},
        {"inputs": 10**12},
        {"weights": {}},
    ],
)
def test_a_state_that_is_none_of_this_network_is_refused(state, spoiled):
    with pytest.raises((UnusableInput, ValueError, TypeError, RuntimeError)):
        GRU.from_saved(state | spoiled)
