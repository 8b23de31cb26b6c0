"""What a saved model holds and what is refused; a stranger's file executes nothing."""

import json
import pickle
from dataclasses import dataclass
from importlib.metadata import EntryPoint

import numpy as np
import pytest
import safetensors.numpy
from safetensors import safe_open

import simgap
from simgap.baselines.mean import Mean
from simgap.records import UnusableInput
from simgap.registry import MODELS
from simgap.saved.archive import read_saved, save_model
from simgap.saved.codec import Encoder, decode_model

THEIRS = """
import numpy as np


class Level:
    def fit(self, data, seed):
        self.level = data.train[0].y[-1]

    def simulate(self, u, y_init):
        return np.tile(self.level, (len(u), u.shape[1] - y_init.shape[1], 1))
"""


def there_and_back(model):
    encoder = Encoder()
    return decode_model(json.loads(json.dumps(encoder.model(model), allow_nan=False)), encoder.arrays)


@pytest.mark.parametrize(
    "value",
    [
        None, True, 3, "text", 0.1, float("inf"), float("-inf"), [1, [2.5]], (1, ("a", None)), {"a": 1, (1, 2): [3]},
        np.float64(0.1), np.float32(0.1), np.int64(3), np.bool_(True), {}, (), [], {"keys": 1, "values": 2},
    ],
    ids=repr,
)  # fmt: skip
def test_an_attribute_comes_back_as_it_was(value):
    model = Mean()
    model.level = value
    loaded = there_and_back(model).level
    assert (type(loaded), loaded) == (type(value), value)


@pytest.mark.parametrize("dtype", ["float64", "float32", "int64", "uint8", "bool", ">f8"])
@pytest.mark.parametrize("shape", [(), (0, 2), (3, 4), (2, 3, 4)])
def test_an_array_comes_back_to_the_bit_and_in_its_order_in_memory(dtype, shape):
    values = np.random.default_rng(0).normal(size=shape).astype(dtype)
    for array in (values, np.asfortranarray(values), values[..., ::2] if shape else values):
        model = Mean()
        model.level, model.rest = array, {"level": array}
        loaded = there_and_back(model)
        for one in (loaded.level, loaded.rest["level"]):
            np.testing.assert_array_equal(one, array)
            assert one.dtype == array.dtype.newbyteorder("=")
            assert one.flags.c_contiguous or array.flags.f_contiguous


def test_what_is_private_stays_behind():
    model = Mean()
    model.level, model._secret = np.ones(1), "the training data"
    assert vars(there_and_back(model)).keys() == {"level"}


@pytest.mark.parametrize("value", [lambda: 0, {1, 2}, 1j, b"bytes", np.array(["a"]), np.array([None]), Encoder()])
def test_what_a_file_cannot_hold_is_named(value):
    model = Mean()
    model.level = {"deep": [value]}
    with pytest.raises(UnusableInput, match=r"level\.deep\.0 is a"):
        Encoder().model(model)


def test_a_model_that_is_not_registered_is_not_saved(dataset, tmp_path):
    @dataclass
    class Mine(Mean):
        pass

    model = Mine()
    model.fit(dataset.training, 0)
    with pytest.raises(UnusableInput, match="Mine is not registered"):
        save_model(model, tmp_path / "mine", dataset)
    assert not (tmp_path / "mine").exists()


@pytest.fixture
def saved(dataset, tmp_path):
    """A small linear model on disk."""
    save_model(simgap.fit("arx", dataset, {"na": 1, "nb": 1}).model, tmp_path / "arx", dataset)
    return tmp_path / "arx"


def edit(file, change):
    """Change the JSON of a saved model in place."""
    with safe_open(file, framework="numpy") as archive:
        about = json.loads(archive.metadata()["simgap"])
        arrays = {name: archive.get_tensor(name) for name in archive.keys()}  # noqa: SIM118
    change(about, arrays)
    file.write_bytes(safetensors.numpy.save(arrays, {"simgap": json.dumps(about)}))


def test_it_says_what_it_was_fitted_on(saved, dataset):
    read = read_saved(saved)
    assert read.name == "arx"
    about = read.fitted_on
    assert (about.dataset, about.sha256, about.dt, about.n_init) == ("noise", dataset.sha256, 0.1, 4)
    assert about.channels == dataset.channels


class Bomb:
    def __reduce__(self):
        return (exec, ("raise SystemExit('executed')",))


@pytest.mark.parametrize(
    "spoil",
    [
        lambda file: file.write_bytes(pickle.dumps(Bomb())),
        lambda file: file.write_bytes(b""),
        lambda file: file.write_bytes(b"\xff" * 100),
        lambda file: file.write_bytes(file.read_bytes()[:-1]),
        lambda file: file.write_bytes(safetensors.numpy.save({"a": np.ones(3)})),
        lambda file: file.write_bytes(safetensors.numpy.save({}, {"simgap": "{"})),
        lambda file: file.write_bytes(safetensors.numpy.save({}, {"simgap": "[]"})),
        lambda file: file.write_bytes(safetensors.numpy.save({}, {"simgap": "[" * 100_000})),
    ],
)
def test_a_file_that_is_no_model_is_refused(saved, spoil):
    spoil(saved)
    with pytest.raises(UnusableInput, match="is no saved model"):
        simgap.load_model(saved)


def polynomial(about):
    return about["state"]["result"]["state"]["polynomial"]["state"]


@pytest.mark.parametrize(
    "change",
    [
        lambda about, arrays: about.pop("state"),
        lambda about, arrays: about.pop("fitted_on"),
        lambda about, arrays: about["fitted_on"].update(dt=-1),
        lambda about, arrays: about["fitted_on"]["channels"].update(inputs=[]),
        lambda about, arrays: about["state"].update(simulate="text"),
        lambda about, arrays: about["state"].update(__class__="text"),
        lambda about, arrays: about["state"].update(n_params=3),
        lambda about, arrays: about["state"]["result"].update(part="Encoder"),
        lambda about, arrays: about["state"]["result"].update(part="os.system"),
        lambda about, arrays: about["state"]["result"]["state"].update(unheard=1),
        lambda about, arrays: about["state"]["result"]["state"].pop("polynomial"),
        lambda about, arrays: about["state"]["result"]["state"].update(polynomial="text"),
        lambda about, arrays: about["state"]["result"]["state"].update(rows={"tuple": [1]}),
        lambda about, arrays: polynomial(about).update(dt="text"),
        lambda about, arrays: polynomial(about).update(a={"array": "nowhere"}),
        lambda about, arrays: polynomial(about).update(a={"pickle": "text"}),
        lambda about, arrays: arrays.update({"result.polynomial.a": np.zeros((9, 2, 2))}),
        lambda about, arrays: arrays.update({"result.polynomial.a": np.zeros((2, 2))}),
        lambda about, arrays: arrays.update({"result.polynomial.a": np.zeros((2, 2, 2), dtype=int)}),
    ],
)
def test_a_state_that_does_not_fit_the_model_is_refused(saved, change):
    edit(saved, change)
    with pytest.raises(UnusableInput, match="is no saved model"):
        simgap.load_model(saved)


def test_a_model_of_somebody_elses_package_is_found_by_its_entry_point(dataset, tmp_path, monkeypatch):
    (tmp_path / "their_models.py").write_text(THEIRS)
    monkeypatch.syspath_prepend(tmp_path)
    point = EntryPoint("theirs", "their_models:Level", "simgap.models")
    monkeypatch.setattr(MODELS, "_installed", {"theirs": point})
    model = simgap.fit("theirs", dataset).model
    save_model(model, tmp_path / "theirs", dataset)
    loaded = simgap.load_model(tmp_path / "theirs")
    assert type(loaded) is type(model)
    np.testing.assert_array_equal(loaded.level, model.level)


def test_an_unknown_version_is_refused(saved):
    edit(saved, lambda about, arrays: about.update(version=2))
    with pytest.raises(UnusableInput, match="has version 2 of the format, this simgap reads version 1"):
        simgap.load_model(saved)


@pytest.mark.parametrize("name", ["my_arx", "../../evil", None, ["arx"]])
def test_a_model_that_is_not_registered_here_is_refused(saved, name):
    edit(saved, lambda about, arrays: about.update(model=name))
    with pytest.raises(UnusableInput, match="which is not registered here"):
        simgap.load_model(saved)


def test_a_place_without_a_file_is_refused(tmp_path):
    for place in (tmp_path / "nowhere", tmp_path):
        with pytest.raises(UnusableInput, match="is no file; a model is saved with"):
            simgap.load_model(place)


def test_a_grey_box_with_other_parameters_than_its_plant_has_is_refused(dataset, tmp_path):
    file = tmp_path / "grey"
    save_model(simgap.fit("greybox", dataset).model, file, dataset)
    edit(file, lambda about, arrays: arrays.update({"plants.0.theta": np.ones(1)}))
    with pytest.raises(UnusableInput, match="the parameters are not those of such a plant"):
        simgap.load_model(file)


@pytest.mark.parametrize(
    "change",
    [
        lambda about, arrays: about["state"].update(of_x="text"),
        lambda about, arrays: about["state"].update(dt="text"),
        lambda about, arrays: about["state"].update(device="nowhere"),
        lambda about, arrays: about["state"].update(units=10**9),
        lambda about, arrays: about["state"].update(inputs=10**12),
        lambda about, arrays: about["state"].pop("weights"),
        lambda about, arrays: about["state"]["of_y"]["state"].update(middle={"tuple": [0.0, 1.0, 2.0]}),
    ],
)
def test_a_network_whose_state_does_not_fit_is_refused(dataset, tmp_path, change):
    file = tmp_path / "gru"
    save_model(simgap.fit("gru", dataset, {"epochs": 1, "batches": 1, "units": 4}).model, file, dataset)
    edit(file, change)
    with pytest.raises(UnusableInput):
        simgap.load_model(file)


def test_a_model_that_could_not_be_read_again_is_not_saved(dataset, tmp_path):
    model = simgap.fit("gru", dataset, {"epochs": 1, "batches": 1, "units": 4}).model
    model.units = 5
    with pytest.raises(UnusableInput, match="cannot be saved: the weights are not those of such a network"):
        save_model(model, tmp_path / "gru", dataset)


def test_every_class_that_may_be_in_a_file_is_named_once():
    for name in MODELS:
        if not MODELS.why_missing(name):
            names = [part.__name__ for part in getattr(MODELS[name], "parts", ())]
            assert len(set(names)) == len(names)
