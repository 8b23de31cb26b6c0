import json
import subprocess
import sys

import numpy as np
import pytest

import simgap
from simgap.cli import main


def run(capsys, *arguments):
    """Exit code, standard output and standard error of one command."""
    code = main([str(argument) for argument in arguments])
    printed = capsys.readouterr()
    return code, printed.out, printed.err


def test_simgap_alone_prints_its_help(capsys):
    code, out, err = run(capsys)
    assert (code, err) == (0, "")
    assert all(command in out for command in ("run", "report", "list", "fit", "data"))


def test_the_version_is_printed(capsys):
    assert run(capsys, "--version") == (0, "simgap 0.1.0\n", "")


@pytest.mark.parametrize(
    "command",
    [
        "nosuch", "--nosuch", "run --nosuch", "run --jobs many", "run --jobs 0", "run nosuch",
        "run --engine ray", "run --models nosuch", "run --model nosuch.py:A", "run --model nosuch",
        "run --datasets nosuch", "run --json nosuch/rows.json", "list", "list nosuch", "fit",
        "fit nosuch gimbal", "fit mean",
        "fit mean nosuch", "fit mean gimbal --param na", "fit mean gimbal --param =3", "report nosuch",
        "fit arx gimbal --param na=2 --param na=3", "fit arx gimbal --kind phi=position --kind phi=velocity",
        "data", "data nosuch", "data make", "data make nosuch", "data fetch nosuch", "data check nosuch",
    ],
)  # fmt: skip
def test_unusable_arguments_end_with_code_2_and_one_sentence(capsys, command):
    code, out, err = run(capsys, *command.split())
    assert (code, out) == (2, "")
    assert err.startswith("simgap: ")
    assert err.count("\n") == 1


def test_unusable_arguments_leave_no_traceback_in_a_real_process():
    command = [
        sys.executable,
        "-c",
        "import sys; from simgap.cli import main; sys.exit(main())",
        "run",
        "--nosuch",
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("simgap: No such option: --nosuch")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("kind", ["models", "datasets", "suites"])
def test_lists_are_printed_and_written_for_machines(capsys, tmp_path, kind):
    code, out, err = run(capsys, "list", kind, "--json", tmp_path / "list.json")
    assert (code, err) == (0, "")
    for entry in json.loads((tmp_path / "list.json").read_text()):
        assert set(entry) == {"name", "title", "missing"}
        assert entry["name"] in out


def test_run_shows_each_job_and_the_figures_and_writes_json(capsys, tmp_path, suite):
    code, out, err = run(capsys, "run", suite("Mean", "IsNaN"), "--out", tmp_path / "out", "--json", tmp_path / "j")
    assert (code, err) == (0, "")
    assert "[1/2] Mean on noise, seed 0: fitted in" in out
    assert "[deg]" in out  # the column of phi, wrapped to the width of the terminal
    rows = json.loads((tmp_path / "j").read_text())
    assert len(rows) == 8
    assert rows[-1]["metrics"]["phi"]["rmse"] == "inf"


def test_run_ends_with_code_1_when_a_job_failed(capsys, tmp_path, suite):
    code, out, _ = run(capsys, "run", suite("Mean", "RaisesInFit"), "--out", tmp_path / "out")
    assert code == 1
    assert "RaisesInFit on noise, seed 0: error, fit raised RuntimeError: no luck today" in out


def test_report_shows_the_tables_and_writes_the_files(capsys, tmp_path, suite):
    run(capsys, "run", suite("Mean"), "--out", tmp_path / "out")
    code, out, err = run(capsys, "report", tmp_path / "out")
    assert (code, err) == (0, "")
    assert "Free-run fit in percent" in out
    assert (tmp_path / "out" / "leaderboard.md").exists()
    assert (tmp_path / "out" / "results.csv").exists()


def test_fit_prints_what_was_chosen_the_summary_and_scores_with_units(capsys, tmp_path, folder, example):
    code, out, _ = run(
        capsys,
        "fit",
        example("Scaled"),
        folder,
        "--param",
        "factor=2",
        "--seed",
        3,
        "--json",
        tmp_path / "f.json",
    )
    assert code == 0
    assert "Scaled on noise: fitted in" in out
    assert "seed = 3" in out
    assert "always the mean" in out
    assert "deg/s" in out
    row = json.loads((tmp_path / "f.json").read_text())[0]
    assert (row["params"], row["seed"]) == ({"factor": 2}, 3)


def test_fit_prints_warnings_as_notes(capsys, folder, example):
    assert "note: badly conditioned" in run(capsys, "fit", example("Warns"), folder)[1]


@pytest.mark.parametrize("model", ["RaisesInFit", "RaisesInSimulate"])
def test_fit_ends_with_code_1_when_the_model_fails(capsys, folder, example, model):
    code, out, err = run(capsys, "fit", example(model), folder)
    assert code == 1
    assert "raised" in out + err
    assert "Traceback" not in out + err


@pytest.mark.parametrize(
    ("option", "value", "said"), [("--dt", "0,01", "such as 0.01"), ("--seed", "a", "whole number")]
)
def test_a_number_that_is_none_is_refused_with_the_way_to_write_it(capsys, folder, option, value, said):
    code, _, err = run(capsys, "fit", "mean", folder, option, value)
    assert code == 2
    assert f"'{option}': write" in err
    assert said in err
    assert "value error" not in run(capsys, "list", "nosuch")[2].lower()


def test_every_command_that_reads_a_file_takes_the_remedies_for_uneven_time(capsys, tmp_path):
    rng = np.random.default_rng(0)
    t = np.concatenate((0.1 * np.arange(200), 100 + 0.1 * np.arange(200), 200 + 0.1 * np.arange(200)))
    u = np.repeat(rng.choice([-1.0, 1.0], 60), 10)
    y = np.convolve(u, 0.5 ** np.arange(8))[: len(u)] + 0.01 * rng.normal(size=600)
    file, model, out = tmp_path / "gap.csv", tmp_path / "arx.simgap", tmp_path / "out"
    np.savetxt(file, np.column_stack((t, u, y)), delimiter=",", header="t,u,y", comments="")
    named = (file, "--input", "u", "--output", "y")
    assert "--split-gaps starts" in run(capsys, "fit", "arx", *named)[2]
    assert run(capsys, "fit", "arx", *named, "--split-gaps", "--save", model)[0] == 0
    assert run(capsys, "simulate", model, file)[0] == 2
    said = run(capsys, "simulate", model, file, "--split-gaps")[1]
    assert all(f"piece_{k}" in said for k in (1, 2, 3))
    suite = ("run", "--models", "arx", "--out", out, "--datasets")
    assert run(capsys, *suite, *named)[0] == 2
    assert run(capsys, *suite, *named, "--split-gaps")[0] == 0
    assert run(capsys, "report", out, "--no-site")[0] == 0
    assert "no learning rate" in run(capsys, "range-test", "arx", *named, "--resample", "0.1")[2]


def test_a_misspelt_name_is_answered_with_the_one_that_is_meant(capsys, folder):
    assert "called 'arxx'; is arx" in run(capsys, "fit", "arxx", folder)[2]


@pytest.mark.parametrize("model", ["arx", "mean", "gru"])
def test_what_is_known_of_the_machine_is_refused_for_models_that_make_no_use_of_it(capsys, folder, model):
    code, _, err = run(capsys, "fit", model, folder, "--known", "mass=0.5kg")
    assert code == 2
    assert err.strip() == (
        f"simgap: --known: {model} cannot be told of the machine; grey boxes can, such as greybox-auto"
    )


def test_data_check_says_what_a_folder_holds(capsys, folder):
    code, out, _ = run(capsys, "data", "check", folder)
    assert code == 0
    assert "noise: usable, sampled every 0.1 s" in out
    assert "test   experiments: 2, samples: 150" in out
    assert "output phi" in out


def test_parameters_are_read_as_in_a_suite():
    from simgap.cli.options import parse_params

    given = ["a=3", "b=1e-3", "c=word", 'd="4"', "e=true", "f=[1, 2]", "g="]
    assert parse_params(given) == {"a": 3, "b": 1e-3, "c": "word", "d": "4", "e": True, "f": [1, 2], "g": ""}


def test_a_network_is_fitted_saved_and_loaded_again(capsys, folder, tmp_path):
    code, out, err = run(
        capsys, "fit", "gru", folder, "--param", "epochs=1", "--param", "batches=2", "--save", tmp_path / "w"
    )
    assert (code, err) == (0, "")
    assert "epochs = 1" in out
    assert f"Saved: {tmp_path / 'w'}" in out
    assert simgap.load_model(tmp_path / "w").n_params > 3000


def test_a_model_that_is_not_registered_is_not_saved_and_says_so_before_the_fit(capsys, folder, tmp_path, example):
    code, out, err = run(capsys, "fit", example("Mean"), folder, "--save", tmp_path / "w")
    assert (code, out) == (2, "")
    assert "is not registered, and a file names the model that reads it" in err
    assert not (tmp_path / "w").exists()


def test_a_range_test_writes_its_curve(capsys, folder, tmp_path):
    page, file = tmp_path / "rates.html", tmp_path / "rates.json"
    code, out, err = run(capsys, "range-test", "srnn", folder, "--html", page, "--json", file)
    assert (code, err) == (0, "")
    assert "falls fastest at a learning rate of" in out
    assert len(json.loads(file.read_text())["rates"]) > 50
    assert "learning rate" in page.read_text()
