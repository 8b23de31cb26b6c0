"""Every registered model, and the model of a diagnosis, simulates to the bit as before once it has been saved."""

import subprocess
import sys
import warnings

import numpy as np
import pytest

import simgap
from simgap.contract import N_INIT, candidate, toy_experiment
from simgap.data.simulated.rigs import hide
from simgap.records import Dataset, TrainingSet
from simgap.registry import MODELS
from simgap.saved.archive import save_model

pytestmark = pytest.mark.slow
AT_HAND = [name for name in MODELS if not MODELS.why_missing(name)]
TRAINING = TrainingSet(tuple(toy_experiment(i, 250) for i in range(2)), (toy_experiment(2, 100),), N_INIT)
IN_A_NEW_PROCESS = """
import sys
from pathlib import Path
import numpy as np
import simgap
folder = Path(sys.argv[1])
for file in folder.glob("*.simgap"):
    signals = np.load(file.with_suffix(".npz"))
    np.save(file.with_suffix(".npy"), simgap.load_model(file).simulate(signals["u"], signals["y_init"]))
"""


def keep(folder, name, model, dataset, experiment):
    """Save a model and what it simulates."""
    save_model(model, folder / f"{name}.simgap", dataset)
    signals = {"u": experiment.u[None], "y_init": experiment.y[None, : dataset.n_init]}
    np.savez(folder / f"{name}.npz", **signals, y_hat=model.simulate(**signals))


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A folder of saved models, with what each simulated before and after."""
    folder = tmp_path_factory.mktemp("kept")
    toy = Dataset("toy", TRAINING, (toy_experiment(9),), N_INIT, TRAINING.channels)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what a fit says of toy data
        for name in AT_HAND:
            model = candidate(name, {"epochs": 1, "batches": 2} if hasattr(MODELS[name], "epochs") else {}).build()
            model.fit(TRAINING, 0)
            keep(folder, name, model, toy, toy_experiment(9))
    stage = hide("stage", {"coulomb_friction": 0.5, "sensor_drift": 0.5})
    keep(folder, "diagnosis", simgap.diagnose(stage, views_too=False).model, stage, stage.test[0])
    effects = MODELS["greybox"](effects=["backlash", "input_saturation", "coulomb_friction", "curved_sensor"])
    effects.fit(stage.training, 0)
    keep(folder, "effects", effects, stage, stage.test[0])
    subprocess.run([sys.executable, "-W", "error", "-c", IN_A_NEW_PROCESS, folder], check=True, timeout=300)
    return folder


@pytest.mark.parametrize("name", [*AT_HAND, "diagnosis", "effects"])
def test_loaded_in_a_new_process_it_simulates_to_the_bit_as_before(name, kept):
    before = np.load(kept / f"{name}.npz")["y_hat"]
    assert np.isfinite(before).all()
    np.testing.assert_array_equal(np.load(kept / f"{name}.npy"), before)


def test_the_model_of_a_diagnosis_is_a_grey_box_with_its_effects(kept):
    loaded = simgap.load_model(kept / "diagnosis.simgap")
    assert isinstance(loaded, MODELS["greybox"])
    assert "coulomb_friction" in loaded.fitted["effects"][0]
    assert loaded.n_params > 3


@pytest.mark.parametrize("name", AT_HAND)
def test_the_training_data_stay_behind(name, kept):
    content = (kept / f"{name}.simgap").read_bytes()
    for x in TRAINING.train:
        for signal in (x.u, x.y, x.y[:, 0], np.diff(x.y, axis=0)):
            assert signal[100:110].tobytes() not in content


def test_a_loaded_linear_model_still_has_its_coefficients(kept):
    loaded = simgap.load_model(kept / "arx.simgap")
    assert "y0: residual standard deviation" in loaded.summary()
    assert "poles of the simulation" in loaded.summary()
