"""A folder in the dataset format: what is read, what is chosen, what is refused."""

import numpy as np
import pytest

from simgap.data import load


def edit(folder, old: str, new: str) -> None:
    file = folder / "dataset.toml"
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def test_a_folder_is_read_as_it_describes_itself(good):
    data = load(good)
    assert data.name == "my_data"
    assert data.n_init == data.training.n_init == 2
    assert data.training.dt == 0.1
    assert [channel.unit for channel in data.channels.inputs + data.channels.outputs] == ["V", "deg"]
    assert data.channels.outputs[0].kind == "position"
    assert [e.name for e in data.training.train + data.training.valid + data.test] == [
        "000",
        "001",
        "002",
        "003",
    ]
    first_row = (good / "train" / "000.csv").read_text().splitlines()[1].split(",")
    assert [data.training.train[0].u[0, 0], data.training.train[0].y[0, 0]] == [float(x) for x in first_row[1:]]


def test_without_valid_the_last_quarter_of_each_training_experiment_validates(good):
    whole = load(good).training.train
    edit(good, 'valid = "valid/*.csv"\n', "")
    training = load(good).training
    assert [len(e) for e in training.train + training.valid] == [15, 15, 5, 5]
    assert [e.name for e in training.valid] == ["000_tail", "001_tail"]
    for record, head, tail in zip(whole, training.train, training.valid, strict=True):
        assert np.array_equal(record.u, np.concatenate([head.u, tail.u]))


def test_n_init_is_a_tenth_of_the_shortest_experiment_when_it_is_not_given(good):
    edit(good, "n_init = 2\n", "")
    assert load(good).n_init == 2
    edit(good, 'valid = "valid/*.csv"\n', "")
    assert load(good).n_init == 1


def test_n_init_is_20_at_most_when_it_is_not_given(tmp_path):
    file = tmp_path / "log.csv"
    file.write_text("u,y\n" + "".join(f"{k % 7},{k % 5}\n" for k in range(3000)))
    assert load(file, ["u"], ["y"], dt=1.0).n_init == 20


def test_files_are_read_in_natural_order(good):
    for k, name in enumerate(("run_10.csv", "run_9.csv", "run_1.csv")):
        (good / "train" / f"{k:03d}.csv").write_text((good / "test" / "003.csv").read_text())
        (good / "train" / f"{k:03d}.csv").rename(good / "train" / name)
    assert [e.name for e in load(good).training.train] == ["run_1", "run_9", "run_10"]


def test_experiments_of_one_name_are_told_apart_by_their_split(good):
    (good / "test" / "003.csv").rename(good / "test" / "000.csv")
    data = load(good)
    assert [e.name for e in data.test] == ["test_000"]
    assert data.training.train[0].name == "train_000"


def test_files_that_differ_only_in_their_ending_are_told_apart(good):
    (good / "train" / "001.csv").rename(good / "train" / "000.txt")
    edit(good, "train/*.csv", "train/*")
    assert [e.name for e in load(good).training.train] == ["train/000.csv", "train/000.txt"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("n_init = 2", "n_start = 2", "unknown key 'n_start'; known are name, sampling_time, time, n_init"),
        ('unit = "V"', 'units = "V"', "unknown key 'units'; known are name, unit, kind"),
        ('valid = "', 'validation = "', "unknown key 'validation'; known are train, valid, test"),
        ('"position"', '"angle"', "position, velocity, level, other"),
        ('"position"', "[]", "position, velocity, level, other"),
        ("sampling_time = 0.1", "", "sampling_time is missing"),
        ("sampling_time = 0.1", "sampling_time = 0", "positive number of seconds"),
        ("sampling_time = 0.1", "sampling_time = nan", "positive number of seconds"),
        ("sampling_time = 0.1", "sampling_time = true", "positive number of seconds"),
        ("sampling_time = 0.1", 'sampling_time = "0.1"', "positive number of seconds"),
        ("sampling_time = 0.1", f"sampling_time = 0x{'f' * 9000}", "positive number of seconds"),
        ("n_init = 2", "n_init = 0", "whole number"),
        ("n_init = 2", "n_init = 2.0", "whole number"),
        ("n_init = 2", f"n_init = 0x{'f' * 9000}", "whole number"),
        ("n_init = 2", "n_init = 20", "experiment 000 has 20 rows"),
        ('name = "my_data"', "name = 7", "name must be a text"),
        ('name = "my_data"', 'name = "../etc"', "not usable"),
        ('name = "u"', 'name = ""', "name of inputs must be a text"),
        ('name = "u"', 'name = " u"', "cannot name a column"),
        ('name = "u"', 'name = "phi"', "'phi' is named twice"),
        ('time = "t"', 'time = "u"', "'u' is named twice"),
        ("[[inputs]]", "[inputs]", "one [[inputs]] table per column"),
        ("sampling_time = 0.1 ", "sampling_time = ", "line 2"),
        ("[splits]", "[splits", "line 15"),
        ("n_init = 2", f"n_init = {'[' * 5000}", "nested"),
        ("n_init = 2", f"n_init = {'9' * 5000}", "no TOML"),
        ("train/*.csv", "train/*.dat", "matches no file"),
        ("test/*.csv", "train/000.csv", "stands in the splits twice"),
        ("train/*.csv", "../*/train/*.csv", "leads out of the folder"),
        ("train/*.csv", "/etc/*", "leads out of the folder"),
        ("train/*.csv", "..\\\\x\\\\*.csv", "leads out of the folder"),
        ("train/*.csv", "C:/x/*.csv", "leads out of the folder"),
        ("train/*.csv", ".", "leads out of the folder"),
        ("train/*.csv", "**x", "train"),  # no pattern before Python 3.13, one that matches nothing since
        ("train/*.csv", "**", "my_data, a folder"),
        ('"train/*.csv"', "[]", "splits.train must be a text"),
    ],
)
def test_a_wrong_description_is_refused_by_file_and_key(good, refused, old, new, said):
    edit(good, old, new)
    sentence = refused(good)
    assert said in sentence
    assert str(good) in sentence or "data set name" in sentence


def test_inputs_that_are_no_tables_are_refused(good, refused):
    text = (good / "dataset.toml").read_text().replace('[[inputs]]\nname = "u"\nunit = "V"\n', "")
    (good / "dataset.toml").write_text("inputs = [1]\n" + text)
    assert "one [[inputs]] table per column" in refused(good)


def test_a_folder_of_nothing_is_told_what_it_needs(refused, tmp_path):
    assert "holds no dataset.toml and no CSV file; give a folder of CSV files" in refused(tmp_path)


def test_a_description_that_is_not_utf_8_is_refused_by_its_line(good, refused):
    edit(good, 'unit = "V"', 'unit = "µV"')
    (good / "dataset.toml").write_bytes((good / "dataset.toml").read_text().encode("latin-1"))
    assert "line 8 is not UTF-8" in refused(good)


def test_a_link_out_of_the_folder_is_refused(good, refused, tmp_path):
    (tmp_path / "secret.csv").write_text((good / "test" / "003.csv").read_text())
    (good / "train" / "009.csv").symlink_to(tmp_path / "secret.csv")
    assert "link out of the folder" in refused(good)


def test_a_link_to_itself_is_refused(good, refused):
    (good / "train" / "loop.csv").symlink_to(good / "train" / "loop.csv")
    sentence = refused(good)  # glob itself stumbles over it before Python 3.13
    assert "no usable pattern" in sentence or "no ordinary file" in sentence


def test_a_folder_with_the_name_of_a_csv_file_is_refused(good, refused):
    (good / "train" / "004.csv").mkdir()
    assert "004.csv, a folder" in refused(good)


def test_a_test_file_that_is_a_link_to_a_training_file_is_refused(good, refused):
    (good / "test" / "004.csv").symlink_to(good / "train" / "000.csv")
    assert "004.csv stands in the splits twice" in refused(good)


def test_a_bad_cell_in_one_of_many_files_is_found(good, refused):
    file = good / "valid" / "002.csv"
    lines = file.read_text().splitlines()
    lines[4] = "0.3,,1"
    file.write_text("\n".join(lines))
    assert f"{file}: row 5, column 'u': the cell is empty" in refused(good)


def test_a_missing_column_in_one_of_many_files_is_found(good, refused):
    file = good / "test" / "003.csv"
    file.write_text(file.read_text().replace("phi", "theta", 1))
    assert f"{file}: row 1 has no column 'phi'" in refused(good)


def test_time_is_checked_against_the_declared_sampling_time(good, refused):
    edit(good, "sampling_time = 0.1 ", "sampling_time = 0.2 ")
    assert "000.csv: row 3, column 't': time goes from 0 to 0.1 s where a step of 0.2 s is due" in refused(good)


def test_an_input_that_moves_between_but_not_within_experiments_is_accepted(good):
    for k, name in enumerate(("000", "001")):
        rows = "".join(f"{i / 10},{k},{i % 3}\n" for i in range(20))
        (good / "train" / f"{name}.csv").write_text("t,u,phi\n" + rows)
    assert load(good).training.train[1].u[0, 0] == 1


def test_the_columns_of_a_folder_cannot_be_named_again(good, refused):
    assert "knows its columns" in refused(good, inputs=["u"])


def test_a_file_in_another_unit_than_the_description_is_refused(good, refused):
    file = good / "train" / "001.csv"
    file.write_text(file.read_text().replace("t,u,phi", "t,u [V],phi [deg]"))
    load(good)
    file.write_text(file.read_text().replace("phi [deg]", "phi [rad]"))
    assert "001.csv: phi is in rad, but in deg in the data set; convert the column" in refused(good)
