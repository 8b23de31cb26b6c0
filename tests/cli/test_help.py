"""What the commands say of themselves: whole sentences on a terminal of 80 columns, and all that may be chosen."""

import json

import pytest

from simgap.cli import main
from simgap.exports.export import FORMATS


@pytest.mark.parametrize("group", ["", "data", "recovery"])
def test_no_command_is_described_by_half_a_sentence(capsys, monkeypatch, group):
    monkeypatch.setenv("COLUMNS", "80")
    assert main([*group.split(), "--help"]) == 0
    lines = capsys.readouterr().out.partition("Commands:")[2].strip("\n").splitlines()
    assert lines
    for line in lines:
        assert line.endswith(".") and not line.endswith("..")
        assert len(line) <= 80


def test_the_help_of_export_lists_every_format(capsys):
    main(["export", "--help"])
    assert f"The format: {', '.join(FORMATS)}." in " ".join(capsys.readouterr().out.split())


def test_the_recovery_study_is_listed_and_named_wherever_suites_are(capsys, tmp_path):
    assert main(["list", "suites", "--json", str(tmp_path / "suites.json")]) == 0
    assert "recovery" in {entry["name"] for entry in json.loads((tmp_path / "suites.json").read_text())}
    assert main(["run", "nosuch"]) == 2
    assert "tuned, recovery" in capsys.readouterr().err
    main(["run", "--help"])
    assert "`simgap run recovery` is a study instead" in capsys.readouterr().out


def test_a_new_model_is_followed_by_the_commands_that_the_readme_names(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["new-model", "my_arx"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert [line.strip() for line in said[1:]] == [
        "simgap try-model my_arx.py",
        "simgap run smoke --model my_arx.py:MyArx --models arx --out my_results",
    ]


def test_data_check_says_whether_the_inputs_are_white(capsys, tmp_path):
    rows = "".join(f"{k / 10},{k % 50 // 25},{k % 7}\n" for k in range(200))
    (tmp_path / "log.csv").write_text("t,u,y\n" + rows)
    assert main(["data", "check", str(tmp_path / "log.csv"), "--input", "u", "--output", "y"]) == 0
    assert "(other), not white in any training experiment" in capsys.readouterr().out
