"""No fit knows the test records: with noise in their place, every fitted model is the same to the bit."""

import json
from dataclasses import replace
from unittest import mock

import numpy as np
import pytest

import simgap
from simgap.contract import N_INIT, toy_experiment, toy_training
from simgap.data import save
from simgap.records import Channel, Channels, Dataset, Experiment
from simgap.registry import MODELS
from simgap.running.fitting import model_class
from simgap.saved.codec import Encoder

CHANNELS = Channels((Channel("u", "V"),), (Channel("x", "m", "position"), Channel("v", "m/s", "velocity")))
QUICK = ("mean", "hold", "fir", "arx", "fir-regularised")
SMALL = {"epochs": 1, "batches": 3}  # for networks


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """One data set twice: with its test records, and with noise of another size and length instead of them."""
    training = replace(toy_training(), channels=CHANNELS)
    rng = np.random.default_rng(0)
    noise = Experiment("test", 50 * rng.normal(size=(90, 1)), 20 + 30 * rng.normal(size=(90, 2)), 0.1)
    paths = []
    for name, test in (("real", replace(toy_experiment(30), name="test")), ("noise", noise)):
        save(Dataset("toy", training, (test,), N_INIT, CHANNELS), path := tmp_path_factory.mktemp(name) / "toy")
        paths.append(path)
    return paths


def fitted(name, folder):
    """What a file of the fitted model would hold, and its errors on the test records."""
    params = {key: value for key, value in SMALL.items() if hasattr(model_class(name), key)}
    with mock.patch("time.perf_counter", return_value=0.0):  # a network remembers how long it was trained
        done = simgap.fit(name, folder, params if len(params) == len(SMALL) else {})
    encoder = Encoder()
    text = json.dumps(encoder.model(done.model))
    return text, encoder.arrays, [result.metrics for result in done.results]


@pytest.mark.filterwarnings("ignore")  # a linear model may say that it does not fit the toy
@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in MODELS.names()]
)
def test_a_fit_is_the_same_to_the_bit_with_noise_in_place_of_the_test_records(name, folders):
    if reason := MODELS.why_missing(name):
        pytest.skip(reason)
    (text, arrays, errors), (other_text, other_arrays, other_errors) = (fitted(name, folder) for folder in folders)
    assert text == other_text
    assert arrays.keys() == other_arrays.keys()
    for key, array in arrays.items():
        assert array.tobytes() == other_arrays[key].tobytes(), key
    assert errors != other_errors  # the records did change
