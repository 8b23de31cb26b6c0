"""MATLAB and Parquet files: the record that a CSV file would hold, or one sentence."""

import sys
from contextlib import suppress

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from simgap.data import load
from simgap.records import Dataset, UnusableInput

N = 50
RNG = np.random.default_rng(0)
RECORD = {"t": np.arange(N) * 0.1, "u": RNG.normal(size=N), "y": RNG.normal(size=N)}
SHA256 = load(pd.DataFrame(RECORD), ["u"], ["y"]).sha256


@pytest.fixture
def mat(tmp_path):
    """Write a MATLAB file and return its path."""

    def written(held, **options):
        savemat(tmp_path / "log.mat", held, **options)
        return tmp_path / "log.mat"

    return written


@pytest.mark.parametrize("shape", ["row", "column"])
@pytest.mark.parametrize("compressed", [False, True])
def test_the_vectors_of_a_matlab_file_are_a_record(mat, shape, compressed):
    extra = {"Ts": 0.1, "note": "rig 7", "matrix": np.eye(3), "model": {"a": 1.0}, "other": np.arange(7)}
    file = mat(RECORD | extra, oned_as=shape, do_compression=compressed)
    data = load(file, ["u"], ["y"])
    assert data.sha256 == SHA256
    assert data.name == "log"


def test_whole_numbers_of_matlab_are_numbers(mat):
    counts = RECORD | {"y": np.arange(N, dtype=np.int16)}
    assert load(mat(counts), ["u"], ["y"]).training.train[0].y[3, 0] == 3


@pytest.mark.parametrize(
    ("held", "said"),
    [
        (RECORD | {"y": np.arange(40)}, "vectors of different lengths (u 50, y 40)"),
        (RECORD | {"y": np.eye(7)}, "has no vector 'y'; there are 't', 'u'"),
        (RECORD | {"y": RECORD["y"] + 1j}, "has no vector 'y'"),
        (RECORD | {"y": np.where(np.arange(N) == 7, np.nan, 1.0)}, "row 8, column 'y': nan is no measurement"),
        ({"u": np.eye(3)}, "holds no vectors"),
        ({"u": RECORD["u"], "y": RECORD["y"]}, "the sampling time is not known"),
    ],
)
def test_what_is_no_record_in_a_matlab_file_is_refused(mat, refused, held, said):
    file = mat(held)
    sentence = refused(file, ["u"], ["y"])
    assert said in sentence
    assert str(file) in sentence


def test_columns_of_a_matlab_file_that_are_not_named_are_asked_for(mat, refused):
    assert "write --input u --output y" in refused(mat(RECORD))


@pytest.fixture
def matlab_7_3(tmp_path, monkeypatch):
    file = tmp_path / "new.mat"
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM"
    file.write_bytes(header.ljust(512, b"\0") + b"\x89HDF\r\n\x1a\n" + bytes(500))
    return file


def test_a_matlab_file_of_version_7_3_without_h5py_is_refused_with_a_remedy(matlab_7_3, refused, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5py", None)
    sentence = refused(matlab_7_3, ["u"], ["y"])
    assert "pip install h5py" in sentence
    assert "-v7" in sentence


def test_a_matlab_file_of_version_7_3_is_read_with_h5py(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "log.mat", "w", userblock_size=512) as file:
        for name, values in RECORD.items():
            file[name] = values[None]
    with (tmp_path / "log.mat").open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM")
    assert load(tmp_path / "log.mat", ["u"], ["y"]).sha256 == SHA256


def test_a_broken_matlab_file_of_version_7_3_is_refused(matlab_7_3, refused):
    pytest.importorskip("h5py")
    assert "cannot be read as a MATLAB file" in refused(matlab_7_3, ["u"], ["y"])


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(at=st.floats(0, 1), piece=st.binary(max_size=20), cut=st.booleans())
def test_a_broken_matlab_file_is_loaded_or_refused_in_one_line(mat, at, piece, cut):
    file = mat({name: values[:20] for name, values in RECORD.items()})
    content = file.read_bytes()
    start = round(at * len(content))
    file.write_bytes(content[:start] + piece + (b"" if cut else content[start + len(piece) :]))
    try:
        assert isinstance(load(file, ["u"], ["y"], dt=0.1), Dataset)
    except UnusableInput as error:
        assert len(str(error).splitlines()) == 1


def test_a_matlab_file_that_crashed_the_reader_is_loaded_or_refused(mat):
    file = mat({"t": np.arange(20.0) * 0.1, "u": np.arange(20.0), "y": np.arange(20.0) ** 2})
    content = file.read_bytes()
    for tail in (b"", content[397:]):
        file.write_bytes(content[:392] + bytes.fromhex("ffff010001") + tail)
        with suppress(UnusableInput):
            assert isinstance(load(file, ["u"], ["y"]), Dataset)


def test_a_matlab_file_on_which_the_reader_crashes_is_refused(mat, refused, monkeypatch):
    monkeypatch.setattr("simgap.data.formats.mat_files.READ", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    assert "cannot be read as a MATLAB file" in refused(mat(RECORD), ["u"], ["y"])


def test_parquet_without_pyarrow_is_refused_with_a_remedy(tmp_path, refused, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    (tmp_path / "log.parquet").write_bytes(b"PAR1")
    assert "pip install pyarrow" in refused(tmp_path / "log.parquet", ["u"], ["y"])


def test_a_parquet_file_is_the_record_of_its_frame(tmp_path):
    pytest.importorskip("pyarrow")
    pd.DataFrame(RECORD).to_parquet(tmp_path / "log.parquet")
    assert load(tmp_path / "log.parquet", ["u"], ["y"]).sha256 == SHA256
    pd.DataFrame(RECORD).set_index("t").to_parquet(tmp_path / "log.parquet")
    assert load(tmp_path / "log.parquet", ["u"], ["y"]).sha256 == SHA256


def test_a_broken_parquet_file_is_refused(tmp_path, refused):
    pytest.importorskip("pyarrow")
    (tmp_path / "log.parquet").write_bytes(b"PAR1 and nothing else")
    assert "cannot be read as Parquet" in refused(tmp_path / "log.parquet", ["u"], ["y"])


@pytest.mark.parametrize("zone", [None, "Europe/Berlin"])
@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
def test_dates_of_pandas_are_a_time(zone, unit):
    frame = pd.DataFrame(RECORD)
    stamps = pd.date_range("2024-05-01 12:00", periods=N, freq="100ms" if unit != "s" else "1s", tz=zone)
    data = load(frame.assign(t=stamps.as_unit(unit)), ["u"], ["y"])
    assert data.training.dt == (0.1 if unit != "s" else 1.0)


def test_dates_in_the_index_of_a_frame_are_a_time_if_it_has_a_name():
    stamps = pd.date_range("2024-05-01 12:00", periods=N, freq="100ms", name="time")
    assert load(pd.DataFrame(RECORD, index=stamps).drop(columns="t"), ["u"], ["y"]).sha256 == SHA256


def test_a_missing_date_is_named_by_its_row(refused):
    frame = pd.DataFrame(RECORD)
    frame["t"] = pd.date_range("2024-05-01 12:00", periods=N, freq="100ms")
    frame.loc[7, "t"] = pd.NaT
    assert "row 7, column 't': the time is missing" in refused(frame, ["u"], ["y"])


def test_a_date_of_pandas_that_jumps_is_quoted(refused):
    frame = pd.DataFrame(RECORD)
    frame["t"] = pd.date_range("2024-05-01 12:00", periods=N, freq="100ms")
    frame = frame.drop(index=20)
    assert "row 20, column 't': time goes from 2024-05-01 12:00:01.900000 to" in refused(frame, ["u"], ["y"])


@pytest.mark.parametrize("ending", ["mat", "parquet"])
def test_a_folder_or_nothing_under_such_a_name_is_refused(tmp_path, refused, ending):
    (tmp_path / f"a.{ending}").mkdir()
    assert "holds no dataset.toml" in refused(tmp_path / f"a.{ending}")
    assert "there is no file" in refused(tmp_path / f"b.{ending}", ["u"], ["y"])
