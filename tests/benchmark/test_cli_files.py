"""The newcomer's file on the command line: its columns by name, its kinds said, what was inferred in one line."""

import json

import numpy as np
import pytest

from simgap.cli import main
from simgap.cli.options import check_writable


def run(capsys, *arguments):
    code = main([str(argument) for argument in arguments])
    printed = capsys.readouterr()
    return code, printed.out, printed.err


@pytest.fixture
def motor(tmp_path):
    """A motor of first order, as a data logger writes it."""
    rng = np.random.default_rng(0)
    u = np.repeat(rng.choice([-5.0, 5.0], size=60), 10)
    y = np.zeros(600)
    for t in range(1, 600):
        y[t] = 0.9 * y[t - 1] + 0.4 * u[t - 1]
    y += rng.normal(scale=0.05, size=600)
    rows = "".join(f"{k / 100:.2f},{u[k]:g},{y[k]:.4f}\n" for k in range(600))
    (tmp_path / "motor.csv").write_text("Time (s),Motor voltage [V],Speed [rad/s]\n" + rows)
    return tmp_path / "motor.csv"


COLUMNS = ("--input", "motor voltage", "--output", "speed")
READ = "read: Speed as velocity (rad/s, by name and unit), sampling time 0.01 s from column Time\n"


@pytest.mark.parametrize("command", [("diagnose",), ("fit", "mean"), ("data", "check")])
def test_what_was_read_off_the_header_is_said_in_one_line(capsys, motor, command):
    code, out, err = run(capsys, *command, motor, *COLUMNS)
    assert (code, err) == (0, "")
    assert out.startswith(READ)


def test_data_check_shows_names_units_and_kinds(capsys, motor, tmp_path):
    code, out, _ = run(capsys, "data", "check", motor, *COLUMNS, "--json", tmp_path / "j")
    assert code == 0
    assert "input  Motor voltage: -5 to 5 V" in out
    assert "rad/s (velocity)" in out
    assert json.loads((tmp_path / "j").read_text())["outputs"][0]["name"] == "Speed"


@pytest.mark.parametrize("kind", ["other", "Speed=other", "speed=other", "Speed [rad/s]=other"])
def test_a_kind_that_is_said_needs_no_inference(capsys, motor, kind):
    code, out, _ = run(capsys, "data", "check", motor, *COLUMNS, "--kind", kind)
    assert code == 0
    assert "rad/s (other)" in out
    assert out.startswith("read: sampling time")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--kind", "fast"), "use one of position, velocity, level, other"),
        (("--kind", "torque=other"), "there are the outputs 'Speed'"),
        (("--kind", "=other"), "write it as NAME=KIND"),
        (("--kind", "other", "--kind", "level"), "write it as NAME=KIND"),
        (("--resample", "0"), "positive number of seconds"),
        (("--output", "nosuch"), "there are 'Time (s)', 'Motor voltage [V]', 'Speed [rad/s]'"),
    ],
)
@pytest.mark.parametrize("command", [("diagnose",), ("fit", "mean"), ("data", "check")])
def test_what_cannot_be_is_refused_in_one_sentence(capsys, motor, command, arguments, said):
    code, out, err = run(capsys, *command, motor, *COLUMNS, *arguments)
    assert (code, out) == (2, "")
    assert said in err
    assert err.count("\n") == 1


def test_a_file_alone_is_told_which_options_it_needs(capsys, motor):
    code, _, err = run(capsys, "diagnose", motor)
    assert code == 2
    assert '--input "Motor voltage" --output Speed' in err


def test_uneven_time_is_put_right_by_the_option_that_the_refusal_names(capsys, motor):
    lines = motor.read_text().splitlines()
    motor.write_text("\n".join(lines[:301] + lines[341:]))
    code, _, err = run(capsys, "fit", "mean", motor, *COLUMNS)
    assert code == 2
    assert "--split-gaps" in err
    code, out, _ = run(capsys, "fit", "mean", motor, *COLUMNS, "--split-gaps")
    assert code == 0
    assert "2 experiments of one file, cut at 1 gap in" in out
    code, out, _ = run(capsys, "data", "check", motor, *COLUMNS, "--split-gaps", "--resample", "0.02")
    assert code == 0
    assert "560 rows resampled to 280 samples every 0.02 s, each the mean over 0.02 s" in out


@pytest.mark.parametrize(
    "command",
    [
        "fit arx LOG --input u --output phi --save LOG", "fit arx LOG --input u --output phi --json LOG",
        "fit my_model.py:Mine LOG --input u --output phi --json my_model.py", "simulate a.simgap LOG --out LOG",
        "diagnose LOG --input u --output phi --html LOG", "next LOG --input u --output phi --out LOG",
        "diagnose logs --input u --output phi --json LOG", "run smoke --datasets LOG --json LOG",
        "tune arx LOG --range na=1..3 --json LOG", "diagnose LOG --html a.html --json ./a.html",
    ],
)  # fmt: skip
def test_what_is_read_is_never_written_over_and_no_output_over_another(capsys, tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "logs").mkdir()
    for name in ("logs/my.csv", "a.simgap", "my_model.py"):
        (tmp_path / name).write_text("kept")
    code, out, err = run(capsys, *command.replace("LOG", "logs/my.csv").split())
    assert (code, out) == (2, "")
    assert "would be overwritten; give another file" in err or "give each output a file of its own" in err
    assert all((tmp_path / name).read_text() == "kept" for name in ("logs/my.csv", "a.simgap", "my_model.py"))


def test_an_answer_is_written_anew_into_the_folder_of_the_logs(tmp_path):
    (tmp_path / "my.csv").touch()
    (tmp_path / "answer.json").touch()
    check_writable(tmp_path / "answer.json", read=[str(tmp_path)])
