"""What a fit leaves besides its rows survives damage, names its code and data, and holds no measurement."""

import json

import numpy as np
import pytest
from safetensors import safe_open

import simgap
from simgap.data import load, save
from simgap.results import artefacts, store
from simgap.results.artefacts import Artefact

RUNS = {"first": np.linspace(0, 1, 20).reshape(10, 2), "second/..": np.full((3, 2), np.inf)}


@pytest.fixture
def artefact() -> Artefact:
    matrices = (np.eye(2), np.ones((2, 1)), np.ones((2, 2)), np.zeros((2, 1)))
    return Artefact(RUNS, 4, 0.1, "code", "data", matrices, {"source": "my.csv", "inputs": ("u",)})


def test_an_artefact_is_read_as_it_was_written(artefact, tmp_path):
    path = tmp_path / "artefacts" / "full" / "arx" / "mine.safetensors"
    artefacts.write(path, artefact)
    found = artefacts.read(path)
    assert found is not None
    assert list(found.runs) == list(RUNS)
    for name, run in RUNS.items():
        np.testing.assert_allclose(found.runs[name], run, rtol=1e-6)
    for ours, theirs in zip(found.state_space, artefact.state_space, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert (found.n_init, found.dt, found.model_sha256, found.data_sha256) == (4, 0.1, "code", "data")
    assert found.source == {"source": "my.csv", "inputs": ["u"]}
    assert (tmp_path / "artefacts" / ".gitignore").read_text() == "*\n"


@pytest.mark.parametrize("content", [b"", b"no safetensors", b"\x08\0\0\0\0\0\0\0{}      "])
def test_a_damaged_file_is_no_artefact_and_no_error(content, tmp_path):
    path = tmp_path / "one.safetensors"
    path.write_bytes(content)
    assert artefacts.read(path) is None
    assert artefacts.read(tmp_path / "nosuch") is None


def test_a_failed_write_leaves_the_older_artefact_and_nothing_else(artefact, tmp_path, monkeypatch):
    path = tmp_path / "artefacts" / "one.safetensors"
    artefacts.write(path, artefact)
    before = path.read_bytes()

    def fail(*_):
        raise OSError("no space left")

    monkeypatch.setattr("pathlib.Path.replace", fail)
    with pytest.raises(OSError, match="no space left"):
        artefacts.write(path, artefact)
    assert path.read_bytes() == before
    assert sorted(file.name for file in path.parent.iterdir()) == [".gitignore", "one.safetensors"]


def test_a_run_leaves_an_artefact_of_each_fit_that_a_second_run_keeps(dataset, tmp_path):
    save(dataset, tmp_path / "noise")
    out = tmp_path / "out"
    rows = simgap.run("smoke", models=["mean", "fir"], datasets=[str(tmp_path / "noise")], out=out)
    paths = {row.model: artefacts.path_of(out, "smoke", row) for row in rows}
    times = {model: path.stat().st_mtime_ns for model, path in paths.items()}
    assert simgap.run("smoke", models=["mean", "fir"], datasets=[str(tmp_path / "noise")], out=out) == rows
    assert {model: path.stat().st_mtime_ns for model, path in paths.items()} == times

    by_model = {row.model: row for row in rows if row.task == "free_run" and row.experiment == "first"}
    for model, path in paths.items():
        found = artefacts.read(path)
        assert found is not None
        assert found.belongs_to(by_model[model])
        assert load(**found.source).sha256 == dataset.sha256
        error = dataset.test[0].y[4:] - found.runs["first"]
        for i, output in enumerate(("phi", "omega")):
            rmse = by_model[model].metrics[output]["rmse"]
            assert np.sqrt(np.mean(error[:, i] ** 2)) == pytest.approx(rmse, rel=1e-5)
        assert len(found.state_space) == {"mean": 0, "fir": 4}[model]


def test_an_artefact_holds_no_measured_samples(dataset, tmp_path):
    save(dataset, tmp_path / "noise")
    rows = simgap.run("smoke", models=["fir"], datasets=[str(tmp_path / "noise")], out=tmp_path / "out")
    with safe_open(str(artefacts.path_of(tmp_path / "out", "smoke", rows[0])), "np") as file:
        held = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118  # no dictionary
        about = json.loads(file.metadata()["about"])
    assert set(held) == {"run.0", "run.1", "A", "B", "C", "D"}
    assert set(about) == {"experiments", "n_init", "dt", "model_sha256", "data_sha256", "source"}
    measured = np.concatenate([x.y.astype(np.float32).ravel() for x in (*dataset.test, *dataset.training.train)])
    assert not any(np.isin(array.astype(np.float32).ravel(), measured).any() for array in held.values())


def test_what_cannot_be_written_costs_no_figure(dataset, tmp_path):
    save(dataset, tmp_path / "noise")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "artefacts").write_text("a file where the folder should be")
    rows = simgap.run("smoke", models=["mean"], datasets=[str(tmp_path / "noise")], out=tmp_path / "out")
    assert {row.status for row in rows} == {"ok"}
    assert len(store.read(tmp_path / "out" / "smoke")) == len(rows)
