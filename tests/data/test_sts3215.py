"""The loader of a servo's runs, on files of the same form: what they hold, how they are split, and what is refused."""

import json
from itertools import product

import numpy as np
import pytest

from simgap.data import Missing, load
from simgap.data.measured.servo_sts3215 import RAW, runs_of
from simgap.records import UnusableInput

MASSES = (0.535, 0.741, 0.969)


def write_run(folder, clock, kp, mass, arm, shift=0.0, rate=100.0, trajectory="sin_sin", samples=60):
    """A file as K-Scale Labs write them: constants, then a list of readings whose clock jitters."""
    t = np.arange(samples) / rate
    volts = 12.0 + 0.1 * (clock % 3)
    jitter = 1e-4 * np.random.default_rng(clock).standard_normal(samples)
    entries = [
        {"position": float(np.sin(6 * s) + shift), "speed": 0.0, "torque": 1.0, "input_volts": volts, "temp": 37.0,
         "current": 17.0, "load": 0, "timestamp": float(s + j), "goal_position": float(np.sin(6 * s + 0.2)),
         "torque_enable": bool(s < 0.4)}
        for s, j in zip(t, jitter, strict=True)
    ]  # fmt: skip
    content = {"mass": mass, "length": arm, "vin": 15.0, "offset": 0.0, "kp": kp, "kd": 0.0, "ki": 0.0,
               "max_torque": 100.0, "motor": "sts3215", "actuator_id": 11, "ip": "", "sample_rate": rate,
               "trajectory": trajectory, "entries": entries}  # fmt: skip
    name = f"sysid_sts3215_{trajectory}_2025-03-17_{160000 + clock}.json"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(json.dumps(content))
    return folder / name


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """A clone with two repetitions of eighteen conditions; SIMGAP_DATA names it."""
    for clock, (shift, kp, mass, arm) in enumerate(product((0.0, 0.5), (8, 12, 16), MASSES, (0.1, 0.15))):
        write_run(tmp_path / RAW, clock, kp, mass, arm, shift)
    monkeypatch.setenv("SIMGAP_DATA", str(tmp_path))
    return tmp_path


def test_the_first_repetition_is_read_with_what_is_known_of_the_machine(clone):
    data = load("sts3215")
    assert data.training.dt == 0.01
    assert [channel.name for channel in data.channels.inputs] == [
        "goal_rad", "enabled", "volts", "kp", "mass_kg", "arm_m"
    ]  # fmt: skip
    plant = data.channels.plant
    assert plant.controlled and plant.gravity > 0
    assert (plant.mass.column, plant.arm.column, plant.gain.column) == ("mass_kg", "arm_m", "kp")
    run = data.test[0]
    t = 0.01 * np.arange(60)
    assert np.allclose(run.y[:, 0], np.sin(6 * t))
    assert np.allclose(run.u[:, 0], np.sin(6 * t + 0.2))
    assert run.u[:, 1].sum() == 40
    assert set(map(tuple, run.u[:, 3:].tolist())) == {(8.0, 0.969, 0.1)}


def test_gain_12_and_mass_0_969_are_held_out(clone):
    data = load("sts3215")
    names = {"train": data.training.train, "valid": data.training.valid, "test": data.test}
    assert {split: len(runs) for split, runs in names.items()} == {"train": 6, "valid": 2, "test": 10}
    assert [run.name for run in data.training.valid] == [
        "sin_sin_kp16_m0.54_l0.15", "sin_sin_kp16_m0.74_l0.15"
    ]  # fmt: skip
    assert all("kp12" in run.name or "m0.97" in run.name for run in data.test)


def test_all_repetitions_have_names_of_their_own(clone):
    data = runs_of(clone / RAW, "all")
    names = [run.name for run in (*data.training.train, *data.training.valid, *data.test)]
    assert len(names) == len(set(names)) == 36


def test_a_folder_in_the_place_of_the_clone_that_is_another_is_said_to_miss(tmp_path, monkeypatch):
    monkeypatch.setenv("SIMGAP_DATA", str(tmp_path))
    with pytest.raises(Missing, match="sts3215 is not at hand"):
        load("sts3215")


@pytest.mark.parametrize(
    ("spoil", "complaint"),
    [
        (lambda text: text[:-10], "is no run of that servo"),
        (lambda text: text.replace('"goal_position"', '"goal"'), "KeyError 'goal_position'"),
        (lambda text: text.replace('"kp": 8', '"kp": "high"'), "could not convert"),
        (lambda text: text.replace('"sample_rate": 100.0', '"sample_rate": 103.0'), "samples late; leave the file out"),
        (lambda text: text[: text.index("[")] + "[]}", "it is empty; leave the file out"),
    ],
)
def test_a_file_that_is_no_run_is_refused_in_a_sentence_that_names_it(clone, spoil, complaint):
    file = min((clone / RAW).glob("*.json"))
    file.write_text(spoil(file.read_text()))
    with pytest.raises(UnusableInput, match=complaint) as refused:
        load("sts3215")
    assert file.name in str(refused.value)


def test_runs_of_one_gain_and_mass_are_no_data_set(tmp_path):
    write_run(tmp_path, 0, 8, 0.535, 0.1)
    with pytest.raises(UnusableInput, match="no run for the valid split"):
        runs_of(tmp_path, "one")
