"""The ways in: a name, a path, one CSV file, one DataFrame."""

import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

from simgap.data import load, read

ROWS = 50


@pytest.fixture
def frame() -> pd.DataFrame:
    rng = np.random.default_rng(0)
    return pd.DataFrame({"t": np.arange(ROWS) * 0.1, "u": rng.normal(size=ROWS), "y": rng.normal(size=ROWS)})


def test_importing_the_package_loads_no_heavy_library():
    heavy = {"pandas", "scipy", "nonlinear_benchmarks", "torch"}
    code = f"import sys, simgap.data; print({heavy} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_a_record_is_split_in_time_60_20_20(frame):
    data = load(frame, ["u"], ["y"])
    parts = (data.training.train[0], data.training.valid[0], data.test[0])
    assert [(part.name, len(part)) for part in parts] == [("train", 30), ("valid", 10), ("test", 10)]
    assert np.array_equal(np.concatenate([part.y[:, 0] for part in parts]), frame["y"])
    assert data.training.dt == 0.1


def test_a_dataframe_and_its_csv_file_are_the_same_data_set(frame, tmp_path):
    frame.to_csv(tmp_path / "log.csv", index=False)
    assert load(tmp_path / "log.csv", ["u"], ["y"]).sha256 == load(frame, ["u"], ["y"]).sha256


def test_a_csv_file_is_named_after_itself_unless_told_otherwise(frame, tmp_path):
    frame.to_csv(tmp_path / "log.csv", index=False)
    assert load(str(tmp_path / "log.csv"), ["u"], ["y"]).name == "log"
    assert load(tmp_path / "log.csv", ["u"], ["y"], name="rig").name == "rig"


@pytest.mark.parametrize(
    ("file", "name"),
    [("log (1)", "log 1"), ("_log", "log"), ("Ölstand", "Ölstand"), ("a+b", "a b"), ("测量", "测量"), ("()", "record")],
)
def test_any_file_name_names_a_data_set(frame, tmp_path, file, name):
    frame.to_csv(tmp_path / f"{file}.csv", index=False)
    assert load(tmp_path / f"{file}.csv", ["u"], ["y"]).name == name


def test_a_long_file_name_is_cut(frame, tmp_path):
    frame.to_csv(tmp_path / f"{'a' * 100}.csv", index=False)
    assert load(tmp_path / f"{'a' * 100}.csv", ["u"], ["y"]).name == "a" * 80


def test_an_output_that_never_moves_is_refused(frame, tmp_path, refused):
    frame.assign(y=1.5).to_csv(tmp_path / "log.csv", index=False)
    assert "output column 'y' is 1.5 in all 30 rows of the training split" in refused(
        tmp_path / "log.csv", ["u"], ["y"]
    )


def test_changing_the_frame_afterwards_does_not_change_the_data_set(frame):
    data = load(frame, ["u"], ["y"])
    before = data.training.train[0].u[0, 0]
    frame.iloc[0, 1] = 99.0
    assert data.training.train[0].u[0, 0] == before


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (np.nan, "no measurement"),
        (np.inf, "no measurement"),
        (1e300, "no measurement"),
        ("abc", "a str is not a real number"),
        (None, "no measurement"),
        pytest.param(10**400, "beyond float64", id="whole_number"),
    ],
)
def test_a_bad_value_in_a_frame_is_named_by_row_and_column(frame, refused, value, said):
    if not isinstance(value, float) and value is not None:
        frame = frame.astype({"u": object})
    frame.loc[7, "u"] = value
    sentence = refused(frame, ["u"], ["y"])
    assert "column 'u'" in sentence
    assert said in sentence
    assert "row 7" in sentence or value == 10**400


@pytest.mark.parametrize("dtype", [bool, complex, str])
def test_a_frame_column_that_is_not_real_numbers_is_refused(frame, refused, dtype):
    assert "DataFrame: row 0, column 'u'" in refused(frame.assign(u=frame["u"].astype(dtype)), ["u"], ["y"])


def test_a_missing_value_of_pandas_itself_is_refused(frame, refused):
    frame["u"] = frame["u"].astype("Float64")
    frame.loc[3, "u"] = pd.NA
    assert "row 3, column 'u'" in refused(frame, ["u"], ["y"])


def test_a_doubled_column_of_a_frame_is_refused(frame, refused):
    assert "2 times" in refused(pd.concat([frame, frame[["u"]]], axis=1), ["u"], ["y"])


def test_time_in_a_frame_is_checked(frame, refused):
    assert "row 20, column 't'" in refused(frame.drop(index=20), ["u"], ["y"])


def test_an_empty_frame_is_refused(frame, refused):
    assert "no rows" in refused(frame.iloc[:0], ["u"], ["y"])


@pytest.mark.parametrize("source", [None, 3, [1, 2], np.zeros((3, 2))])
def test_anything_else_is_refused(refused, source):
    assert "cannot be made from" in refused(source, ["u"], ["y"])


def test_columns_that_are_not_named_are_asked_for(frame, refused):
    assert "say which columns are the inputs (--input NAME" in refused(frame)
    assert "there are 't', 'u', 'y'" in refused(frame, ["u"])
    assert "inputs=[..] in Python" in refused(frame, "u", ["y"])


def test_a_column_cannot_be_input_and_output(frame, refused):
    assert "named twice" in refused(frame, ["u"], ["u"])


def test_a_sampling_time_that_is_not_known_is_asked_for(frame, refused):
    assert "--dt 0.01" in refused(frame[["u", "y"]], ["u"], ["y"])


@pytest.mark.parametrize("dt", [0.0, -1.0, float("nan"), float("inf")])
def test_a_sampling_time_that_is_none_is_refused(frame, refused, dt):
    assert "positive number of seconds" in refused(frame, ["u"], ["y"], dt=dt)


def test_two_columns_that_could_be_the_time_are_refused(frame, refused):
    assert "rename one" in refused(frame.assign(time=frame["t"]), ["u"], ["y"])


def test_a_time_column_that_is_an_input_is_not_taken_for_the_time(frame):
    assert load(frame, ["t", "u"], ["y"], dt=0.5).training.dt == 0.5


def test_one_row_has_no_sampling_time(frame, refused):
    assert "no time step" in refused(frame.iloc[:1], ["u"], ["y"])


@pytest.mark.parametrize("source", ["no_such_set", "", "a\0b", "x\ny", "a" * 5000])
def test_an_unknown_name_lists_the_known_ones(refused, source):
    sentence = refused(source)
    assert "cascaded_tanks, ced" in sentence


def test_a_file_that_is_not_there_is_told_from_a_name_and_one_like_it_is_offered(refused, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "log.csv").write_text("t,u,y\n")
    assert refused("lgo.csv", ["u"], ["y"]) == "there is no file lgo.csv; is log.csv meant?"
    assert f"seen from the folder {tmp_path}" in refused("other.mat")
    assert "because there is no folder nix" in refused("nix/log.csv")


@pytest.mark.parametrize(("heading", "step", "said"), [("t", 10, True), ("t", 0.1, False), ("t [s]", 10, False)])
def test_times_that_may_count_milliseconds_are_said_to_be_taken_for_seconds(frame, heading, step, said):
    frame = frame.assign(t=step * np.arange(len(frame))).rename(columns={"t": heading})
    assert ("10 s from column t, taken for seconds because" in str(read(frame, ["u"], ["y"]))) == said


def test_the_columns_of_a_registered_data_set_cannot_be_named_again(refused):
    assert "knows its columns" in refused("ced", dt=0.1)
