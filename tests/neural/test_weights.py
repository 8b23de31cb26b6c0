"""Weights on disk: every network comes back as it was, and a stranger's file executes nothing."""

import json
import pickle

import numpy as np
import pytest

import simgap
from simgap.neural.gru import GRU
from simgap.neural.training.network import Network
from simgap.records import UnusableInput
from simgap.registry import MODELS

NETWORKS = [name for name in MODELS if isinstance(MODELS[name], type) and issubclass(MODELS[name], Network)]


@pytest.mark.parametrize("mode", ["windowed", "stateful"])
@pytest.mark.parametrize("name", NETWORKS)
def test_a_network_that_was_saved_simulates_the_same(name, mode, tmp_path, data, simulated):
    model = MODELS[name](mode=mode, window=16, epochs=1, batches=2)
    model.fit(data, 0)
    model.save(tmp_path)
    loaded = simgap.load_model(tmp_path)
    np.testing.assert_array_equal(simulated(loaded), simulated(model))
    assert loaded.n_params == model.n_params
    assert loaded.fitted["epochs"] == 1


@pytest.fixture
def saved(tmp_path, data):
    model = GRU(epochs=1, batches=1, units=4)
    model.fit(data, 0)
    model.save(tmp_path)
    return tmp_path


def edit(folder, **changed):
    file = folder / "model.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | changed))


class Bomb:
    def __reduce__(self):
        return (exec, ("raise SystemExit('executed')",))


@pytest.mark.parametrize(
    "spoil",
    [
        lambda f: (f / "weights.safetensors").write_bytes(pickle.dumps(Bomb())),
        lambda f: (f / "weights.safetensors").write_bytes(b"\xff" * 100),
        lambda f: (f / "weights.safetensors").unlink(),
        lambda f: (f / "model.json").write_text("{"),
        lambda f: (f / "model.json").write_text("[" * 100_000),
        lambda f: (f / "model.json").write_text("[]"),
        lambda f: edit(f, schema=2),
        lambda f: edit(f, model="arx"),
        lambda f: edit(f, model="../../evil"),
        lambda f: edit(f, params={"units": 10**9}),
        lambda f: edit(f, params={"units": 5}),
        lambda f: edit(f, params={"units": -1}),
        lambda f: edit(f, params={"unheard": 1}),
        lambda f: edit(f, params={"mode": "sideways"}),
        lambda f: edit(f, outputs={"middle": [0, 0, 0], "half": [1, 1, 1]}),
        lambda f: edit(f, inputs=10**12),
        lambda f: edit(f, features="nothing"),
    ],
)
def test_a_file_that_is_no_network_is_refused(saved, spoil):
    spoil(saved)
    with pytest.raises(UnusableInput):
        simgap.load_model(saved)


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(UnusableInput, match="holds no network"):
        simgap.load_model(tmp_path / "nowhere")
