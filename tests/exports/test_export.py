"""An export as a user has it: a folder with its record, verified again, and what is refused."""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import simgap
from simgap.cli import main
from simgap.data.simulated.rigs import hide
from simgap.exports.export import _subject, export, verify
from simgap.exports.folders import read_folder
from simgap.records import UnusableInput


@pytest.fixture(scope="module")
def stage():
    return hide("stage", {"coulomb_friction": 0.5})


@pytest.fixture(scope="module")
def rubbing(stage):
    return simgap.fit("greybox", stage, {"effects": ["coulomb_friction"]}).model


@pytest.fixture
def saved(stage, rubbing, tmp_path):
    simgap.save_model(rubbing, tmp_path / "stage.simgap", stage)
    simgap.save(stage, tmp_path / "stage")
    return tmp_path


def test_a_saved_model_is_exported_and_verified_from_the_command_line(saved, capsys):
    arguments = [str(saved / "stage.simgap"), str(saved / "stage"), "--to", "python", "--out", str(saved / "out")]
    assert main(["export", *arguments]) == 0
    assert "the same free run" in capsys.readouterr().out
    assert main(["export", "--verify", str(saved / "out")]) == 0


def test_a_model_is_fitted_first_when_it_is_named(saved, capsys):
    arguments = ["arx", str(saved / "stage"), "--param", "na=2", "--param", "nb=2", "--to", "control"]
    assert main(["export", *arguments, "--out", str(saved / "out")]) == 0
    assert read_folder(saved / "out").model == "arx"


def test_the_python_file_runs_without_any_package(saved):
    export(saved / "stage.simgap", saved / "stage", "python", saved / "out")
    script = "import model; print(len(model.simulate([[1.0]] * 5)), model.INPUTS, model.DT)"
    done = subprocess.run(
        [sys.executable, "-S", "-B", "-c", script], cwd=saved / "out", check=True, capture_output=True, text=True
    )
    assert done.stdout.strip() == "5 ['u'] 0.05"


def test_dry_friction_comes_with_a_record_that_reverses_and_holds_below_breakaway(saved):
    assert export(saved / "stage.simgap", saved / "stage", "python", saved / "out").passed
    _, record = read_folder(saved / "out").records
    assert record.name == "reversal" and record.n == 0
    moves = np.abs(np.diff(record.y_hat[:, 0]))
    assert {-1.0, 1.0} <= {*np.sign(np.diff(record.y_hat[:, 0]))}
    assert np.max(moves[-90:]) < 1e-9, "it does not hold"
    assert np.min(np.abs(record.u[-90:-62])) > 0, "nothing pulls while it holds"


def test_an_export_that_answers_otherwise_is_found(saved, capsys):
    export(saved / "stage.simgap", saved / "stage", "python", saved / "out")
    text = (saved / "out" / "model.py").read_text()
    (saved / "out" / "model.py").write_text(text.replace("return p[i]\n", "return 0.999 * p[i]\n"))
    assert not verify(saved / "out").passed
    assert main(["export", "--verify", str(saved / "out")]) == 1
    assert "NOT the same free run" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["arx", "stage", "--to", "simulink", "--out", "new"], "there is no such format"),
        (["arx", "stage", "--to", "c"], "export needs MODEL DATA"),
        (["arx", "stage", "--to", "c", "--out", "stage"], "exists already"),
        (["arx", "--verify", "stage"], "leave out MODEL"),
        (["--verify", "stage"], "is no export"),
        (["mean", "stage", "--to", "onnx", "--out", "new"], "it can be to"),
        (["no_model", "stage", "--to", "c", "--out", "new"], "there is no model"),
        (["stage.simgap", "stage", "--to", "c", "--out", "new", "--experiment", "e99"], "no experiment 'e99'"),
        (["stage.simgap", "stage", "--to", "c", "--out", "new", "--param", "na=3"], "--param: stage.simgap is a saved"),
    ],
)
def test_what_cannot_be_is_refused_in_one_sentence(saved, arguments, sentence, monkeypatch, capsys):
    monkeypatch.chdir(saved)
    assert main(["export", *arguments]) == 2
    error = capsys.readouterr().err
    assert sentence in error and error.count("\n") == 1
    assert not (saved / "new").exists()


def test_a_damaged_export_is_refused(saved):
    export(saved / "stage.simgap", saved / "stage", "python", saved / "out")
    about = json.loads((saved / "out" / "export.json").read_text())
    for change in (
        {"schema": 9},
        {"records": []},
        {"format": "simulink"},
        {"records": [{"file": "x.csv"}]},
        {"dt": "a"},
    ):
        (saved / "out" / "export.json").write_text(json.dumps(about | change))
        with pytest.raises(UnusableInput):
            verify(saved / "out")
    (saved / "out" / "export.json").write_text(json.dumps(about))
    (saved / "out" / "record.csv").unlink()
    with pytest.raises(UnusableInput, match=r"record.csv is missing"):
        verify(saved / "out")


def test_an_export_that_cannot_run_is_refused_and_a_new_one_leaves_nothing_behind(saved, monkeypatch):
    export(saved / "stage.simgap", saved / "stage", "python", saved / "out")

    def fails(*_):
        raise ValueError("torn")

    monkeypatch.setattr("simgap.exports.formats.python.run", fails)
    with pytest.raises(UnusableInput, match="what is there does not run as python: torn"):
        verify(saved / "out")
    with pytest.raises(UnusableInput, match="torn"):
        export(saved / "stage.simgap", saved / "stage", "python", saved / "new")
    assert not (saved / "new").exists()


def test_a_gymnasium_of_a_saved_model_has_the_range_of_all_records_of_a_data_set(saved, stage):
    training = replace(stage.training, train=tuple(replace(x, u=3 * x.u) for x in stage.training.train))
    simgap.save(replace(stage, training=training, sha256=""), saved / "wide")
    subject = _subject(saved / "stage.simgap", saved / "wide", "gymnasium", {}, 0, None, (None, None, False), {})
    assert subject.input_range[1] == pytest.approx(max(x.u.max() for x in training.train))


def test_names_of_columns_do_no_harm(saved, stage):
    from dataclasses import replace

    from simgap.records import Channels

    inputs, outputs = stage.channels.inputs, stage.channels.outputs
    nasty = Channels((replace(inputs[0], name='u"*/ \n\'""" <&>'),), (replace(outputs[0], name='u"*/ \n\'""" <&>'),))
    named = replace(stage, channels=nasty, training=replace(stage.training, channels=nasty))
    for form in ("python", "c", "fmu", "control", "gymnasium"):
        try:
            assert export("greybox", named, form, saved / form, {"effects": ["coulomb_friction"]}).passed
        except UnusableInput as error:
            assert "not installed" in str(error) or "compiler" in str(error)
