"""What is saved comes back, bit for bit."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from simgap.data import load, save
from simgap.records import Channel, Channels, Dataset, Experiment, TrainingSet, UnusableInput

NUMBERS = st.floats(-1e100, 1e100, allow_subnormal=True)


def dataset_of(tables, names=("a", "b", "c"), dt=0.1, channels=None) -> Dataset:
    train, valid, test = (
        Experiment(name, table[:, :1], table[:, 1:], dt) for name, table in zip(names, tables, strict=True)
    )
    channels = channels or Channels((Channel("u", "V"),), (Channel("y", "deg", "position"), Channel("v")))
    return Dataset("saved", TrainingSet((train,), (valid,), 2, channels), (test,), 2, channels)


def random_tables(seed: int = 0):
    return np.random.default_rng(seed).normal(size=(3, 10, 3))


@settings(max_examples=50, deadline=None)
@given(tables=arrays(np.float64, (3, 5, 3), elements=NUMBERS), dt=st.floats(1e-9, 1e9))
def test_every_bit_comes_back(tables, dt):
    tables[0, 0], tables[0, 1] = 0.0, 1.0  # a signal that never moves is refused
    data = dataset_of(tables, dt=dt)
    with tempfile.TemporaryDirectory() as folder:
        save(data, Path(folder) / "set")
        again = load(Path(folder) / "set")
    assert again.sha256 == data.sha256
    assert again.channels == data.channels
    assert again.name == data.name


def test_saving_what_was_loaded_gives_the_same_files(tmp_path):
    save(dataset_of(random_tables()), tmp_path / "one")
    save(load(tmp_path / "one"), tmp_path / "two")
    for file in (tmp_path / "one").rglob("*.*"):
        assert file.read_bytes() == (tmp_path / "two" / file.relative_to(tmp_path / "one")).read_bytes()


def test_the_order_of_experiments_is_kept_whatever_their_names(tmp_path):
    names = ["b", "a", "a", "../evil", "", "A", "run 10", "run 9"]
    rng = np.random.default_rng(0)
    train = tuple(Experiment(name, rng.normal(size=(10, 1)), rng.normal(size=(10, 1)), 1.0) for name in names)
    channels = Channels((Channel("u"),), (Channel("y"),))
    save(
        Dataset("saved", TrainingSet(train, train[:1], 2, channels), train[1:2], 2, channels),
        tmp_path / "set",
    )
    again = load(tmp_path / "set").training.train
    assert all(np.array_equal(old.u, new.u) for old, new in zip(train, again, strict=True))
    assert again[3].name == "3__evil"
    assert len(list((tmp_path / "set").iterdir())) == 4


def test_a_folder_that_holds_something_is_left_alone(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(UnusableInput, match="is not empty"):
        save(dataset_of(random_tables()), tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == ["notes.txt"]


def test_a_file_in_the_place_of_the_folder_is_left_alone(tmp_path):
    (tmp_path / "taken").write_text("mine")
    with pytest.raises(UnusableInput, match="choose another"):
        save(dataset_of(random_tables()), tmp_path / "taken")


def test_names_with_commas_quotes_and_the_name_of_the_time_column_come_back(tmp_path):
    channels = Channels((Channel('say "u", please', "µV"),), (Channel("t", "°"), Channel("back\\slash")))
    data = dataset_of(random_tables(), channels=channels)
    save(data, tmp_path / "set")
    again = load(tmp_path / "set")
    assert again.channels == channels
    assert again.sha256 == data.sha256


@pytest.mark.parametrize("name", ["", " u", "two\nlines", "y"])
def test_a_channel_that_cannot_be_a_column_is_refused_before_anything_is_written(tmp_path, name):
    channels = Channels((Channel(name),), (Channel("y"), Channel("v")))
    with pytest.raises(UnusableInput, match="column"):
        save(dataset_of(random_tables(), channels=channels), tmp_path / "set")
    assert not (tmp_path / "set").exists()


def test_a_data_set_without_validation_cannot_be_expressed(tmp_path):
    data = dataset_of(random_tables())
    bare = Dataset("bare", TrainingSet(data.training.train, (), 2, data.channels), data.test, 2, data.channels)
    with pytest.raises(UnusableInput, match="no validation experiments"):
        save(bare, tmp_path / "set")
