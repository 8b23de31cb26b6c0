"""Parameters behind the name of a data set: the same machine otherwise measured, and a name that says so."""

import re

import numpy as np
import pytest

from simgap.data import load
from simgap.records import UnusableInput
from simgap.running.suites import load_suite


def test_what_is_not_changed_is_the_same_experiment():
    usual, noisy, short = load("gimbal"), load("gimbal-noise4"), load("gimbal-data0.125")
    assert noisy.name == "gimbal-noise4"
    assert np.array_equal(noisy.test[0].u, usual.test[0].u)
    assert np.std(noisy.test[0].y - usual.test[0].y, axis=0) == pytest.approx([0.15, 4.5], rel=0.2)
    assert len(short.training.train) == 19
    assert all(np.array_equal(a.y, b.y) for a, b in zip(short.test, usual.test, strict=True))


def test_a_name_says_what_is_unusual_in_one_order():
    assert load("gimbal-delay0.2-data0.125").name == "gimbal-data0.125-delay0.2"
    assert load("gimbal-noise1").name == "gimbal"
    assert load("gimbal-data0.05-n_init2").n_init == 2


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("gimbal-foo1", "no parameter 'foo1'; it takes data, noise"),
        ("gimbal-noise1-noise2", "each once"),
        ("gimbal_short-noise2", "it takes none"),
        ("gimbal-n_init2.5", "n_init is a whole number"),
        ("gimbal-data0", "makes 0 training experiments"),
        ("gimbal-data1000000", "1 to 5000 can be made"),
        ("gimbal-log", "there is no data set, folder or CSV file"),
        ("gimbal-log.csv", "there is no file gimbal-log.csv"),
    ],
)
def test_what_cannot_be_made_is_refused_in_one_sentence(name, said):
    with pytest.raises(UnusableInput, match=re.escape(said)):
        load(name)


def test_a_folder_of_such_a_name_is_the_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "gimbal-noise4").mkdir()
    with pytest.raises(UnusableInput, match=r"dataset\.toml"):
        load("gimbal-noise4")


def test_every_condition_of_the_crossover_study_is_called_as_it_is_made():
    names = load_suite("crossover").datasets
    assert len(set(names)) == len(names) == 25
    assert "gimbal" in names
    assert load(names[-1]).name == names[-1]
