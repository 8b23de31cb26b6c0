"""A folder of logs without a description: one record in the order of the names of its files."""

import shutil

import numpy as np
import pytest

from simgap.baselines.arx import Arx
from simgap.cli import main
from simgap.data import load
from simgap.data.loading import read, read_recordings

COLUMNS = {"inputs": ["u"], "outputs": ["phi"]}


def names(experiments):
    return [experiment.name for experiment in experiments]


def test_whole_logs_are_split_60_20_20_in_the_order_of_their_numbers(logs):
    data = load(logs, **COLUMNS)
    assert data.name == "logs"
    assert names(data.training.train) == [f"log{k}" for k in range(1, 7)]
    assert names(data.training.valid) == ["log7", "log8"]
    assert names(data.test) == ["log9", "log10"]
    alone = load(logs / "log10.csv", **COLUMNS)
    whole = np.concatenate([x.y for x in (*alone.training.train, *alone.training.valid, *alone.test)])
    assert np.array_equal(data.test[1].y, whole)


def test_one_log_in_a_folder_is_the_record_of_that_file(logs):
    for k in range(2, 11):
        (logs / f"log{k}.csv").unlink()
    assert load(logs, **COLUMNS, name="one").sha256 == load(logs / "log1.csv", **COLUMNS, name="one").sha256


def test_what_was_inferred_says_how_many_logs_there_are(logs):
    assert "10 logs, split 60/20/20 in this order: log1, log2, log3, .." in read(logs, **COLUMNS).said


def test_what_else_of_a_folder_might_be_a_log_is_said_to_be_left_out(logs):
    assert not any(text.startswith("without") for text in read(logs, **COLUMNS).said)
    (logs / "notes.txt").write_text("new bearing")
    (logs / "picture.png").touch()
    shutil.copy(logs / "log1.csv", logs / "log11.tsv")
    assert "without log11.tsv, notes.txt" in read(logs, **COLUMNS).said


def test_a_folder_with_nothing_but_a_readme_holds_no_log(tmp_path, refused):
    (tmp_path / "README.txt").write_text("The logs are on the other disk.")
    assert "and no CSV file; give a folder of CSV files" in refused(tmp_path, ["u"], ["y"])


def test_logs_that_are_named_one_by_one_are_one_record_in_that_order(logs, capsys):
    files = [str(logs / f"log{k}.csv") for k in (5, 2, 7, 1, 9)]
    data = load(files, **COLUMNS)
    assert [*names(data.training.train), *names(data.training.valid), *names(data.test)] == [
        "log5", "log2", "log7", "log1", "log9"
    ]  # fmt: skip
    assert main(["fit", "arx", *files, "--input", "u", "--output", "phi"]) == 0
    assert "5 logs, split 60/20/20 in this order: log5, log2, log7, .." in capsys.readouterr().out
    (logs / "old").mkdir()
    shutil.copy(files[0], logs / "old" / "log5.csv")
    assert names(load([*files, str(logs / "old" / "log5.csv")], **COLUMNS).training.train)[:2] == ["1_log5", "2_log2"]


@pytest.mark.parametrize(
    ("others", "said"),
    [
        (["log1.csv"], "log1.csv is named twice, and would be in training and test; name each log once"),
        (["../logs/log1.csv"], "log1.csv is named twice"),
        (["../logs"], "is a folder or a data set, so name it alone"),
    ],
)
def test_what_is_no_list_of_different_files_is_refused(logs, refused, others, said):
    assert said in refused([logs / "log1.csv", *(logs / other for other in others)], **COLUMNS)


def test_data_sets_and_nothing_at_all_are_no_list_of_logs(refused):
    assert "gimbal_short is a folder or a data set, so name it alone" in refused(["gimbal_short"])
    assert refused([]) == "a data set cannot be made from this list; give the paths of log files"


@pytest.mark.parametrize("name", ["log99.csv", 300 * "x" + ".csv", "a\0b.csv"])
def test_a_named_log_that_is_not_there_is_said_to_be_missing(logs, refused, name):
    there, missing = str(logs / "log1.csv"), f"{logs}/{name}"
    for files in ([there, missing], [missing, there]):
        assert f"there is no file {missing}" in refused(files, **COLUMNS)


def test_files_of_other_endings_beside_the_csv_files_and_hidden_ones_are_no_logs(logs):
    for name in ("notes.txt", ".log0.csv", "photo.png"):
        (logs / name).write_text("no log")
    (logs / "old.csv").mkdir()
    assert len(read(logs, **COLUMNS).dataset.training.train) == 6


def test_a_gap_in_one_log_parts_that_one(logs):
    lines = (logs / "log1.csv").read_text().splitlines(keepends=True)
    (logs / "log1.csv").write_text("".join(lines[:16] + lines[21:]))
    data = load(logs, **COLUMNS, split_gaps=True)
    assert names(data.training.train)[:3] == ["log1_piece_1", "log1_piece_2", "log2"]


def test_a_fitted_model_simulates_each_log(logs):
    data = load(logs, **COLUMNS)
    model = Arx()
    model.fit(data.training, 0)
    recordings = read_recordings(logs, data.channels)
    assert names(recordings.experiments) == [f"log{k}" for k in range(1, 11)]
    assert not recordings.others


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text.replace("phi", "psi"), "log3.csv: row 1 has no column 'phi'"),
        (lambda text: text.replace("phi", "phi [deg]"), "log3.csv: 'phi' is in 'deg', but in 'no unit' in"),
        (lambda text: text.replace("t,", "t_ms,"), "log3.csv is sampled every 0.0001 s and"),
        (lambda text: text.replace("\n2.0", "\n2.x"), "log3.csv: row"),
    ],
)
def test_a_log_that_does_not_fit_the_others_is_named(logs, refused, change, said):
    text = (logs / "log3.csv").read_text()
    assert change(text) != text
    (logs / "log3.csv").write_text(change(text))
    assert said in refused(logs, **COLUMNS)


def test_the_columns_are_asked_for_as_of_a_single_file(logs, refused):
    assert "log1.csv: say which columns are the inputs" in refused(logs)
