"""A folder of results that holds nothing but a recovery study is a folder of results."""

import json

import pytest

import simgap
from simgap.cli import main
from simgap.records import UnusableInput
from simgap.recovery import score
from simgap.recovery.drawing import digest, draw


@pytest.fixture
def folder(tmp_path):
    cases = draw("a seed", 20)
    answers = {"tool": "mine", "cases": digest("a seed", cases), "answers": {}}
    (tmp_path / "answers.json").write_text(json.dumps(answers))
    (tmp_path / "results" / "recovery").mkdir(parents=True)
    rates = score([tmp_path / "answers.json"], "a seed")
    (tmp_path / "results" / "recovery" / "rates.json").write_text(json.dumps(rates))
    return tmp_path / "results"


def test_its_tables_are_printed_and_stand_in_leaderboard_site_and_figures(folder, capsys):
    (folder / "recovery" / "summary.json").write_text('{"first name right": "3 of 4 (75.0 %)"}')
    assert main(["report", str(folder), "--figures"]) == 0
    assert "recovery study" in capsys.readouterr().out
    page = (folder / "leaderboard.md").read_text()
    assert page.index("## Recovery study") < page.index("3 of 4") < page.index("### Right names")
    assert not (folder / "results.csv").exists()
    assert "no results of models" in (folder / "site" / "index.html").read_text()
    site = (folder / "site" / "recovery.html").read_text()
    assert "Right names" in site
    assert "3 of 4" in site
    assert list((folder / "figures").glob("recovery-Right-names.tex"))


def test_damaged_rates_are_refused(folder):
    for text in ("{}", "[1]", "{", '{"tools": {}}'):
        (folder / "recovery" / "rates.json").write_text(text)
        with pytest.raises(UnusableInput, match="holds no rates"):
            simgap.report(folder)


def test_a_torn_summary_is_refused_and_a_row_without_its_case_is_none(folder):
    (folder / "recovery" / "cases.jsonl").write_text('{"status": "ok"}\n')
    simgap.report(folder)
    (folder / "recovery" / "summary.json").write_text('{"a')
    with pytest.raises(UnusableInput, match=r"summary\.json is no JSON"):
        simgap.report(folder)
