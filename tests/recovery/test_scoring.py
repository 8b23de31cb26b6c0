"""Rates of made-up tools whose answers are known."""

import json

import pytest
from scipy.stats import binomtest

from simgap.cli import main
from simgap.records import UnusableInput
from simgap.recovery import score
from simgap.recovery.drawing import digest, draw, effects
from simgap.reports.recovery_rates import rate_tables, wilson

SEED, COUNT = "a seed of the tests", 40
CASES = draw(SEED, COUNT)
SINGLE, PAIRS, CLEAN, OUTSIDE = 24, 6, 8, 2


def write(path, answers, tool="mine", cases=None):
    path.write_text(json.dumps({"tool": tool, "cases": cases or digest(SEED, CASES), "answers": answers}))
    return path


def rates(path, answers):
    return score([write(path / "answers.json", answers)], SEED)["tools"]["mine"]


def truth(case):
    return [name for name in case.hidden() if name in effects()]


def test_the_truth_is_always_right(tmp_path):
    found = rates(tmp_path, {name: {"names": truth(case), "seconds": 2} for name, case in CASES.items()})
    assert found["first_right"] == found["among_first"] == [SINGLE, SINGLE]
    assert found["both_of_pair"] == [PAIRS, PAIRS]
    assert found["invented_on_clean"] == [0, CLEAN]
    assert found["invented_outside"] == [0, OUTSIDE]
    assert found["wrong_name"] == found["only_suspected"] == [0, SINGLE]
    assert (found["failed"], found["median_seconds"]) == ([0, COUNT], 2)


def test_all_names_at_once_are_one_cause_of_many_names_and_invented_where_nothing_is(tmp_path):
    found = rates(tmp_path, {name: {"names": [list(effects())]} for name in CASES})
    assert found["among_first"] == [SINGLE, SINGLE]
    assert found["first_right"][0] <= 1
    assert found["names_per_first"] == len(effects())
    assert found["both_of_pair"] == [0, PAIRS]
    assert found["invented_on_clean"] == [CLEAN, CLEAN]
    assert found["invented_outside"] == [OUTSIDE, OUTSIDE]


def test_a_list_of_all_names_gains_nothing_by_what_stands_behind_the_first(tmp_path):
    found = rates(tmp_path, {name: {"names": list(effects())} for name in CASES})
    assert found["first_right"] == found["among_first"]
    assert found["first_right"][0] <= 1
    assert found["wrong_name"] == [SINGLE, SINGLE]
    assert found["both_of_pair"][0] <= 1


def test_suspects_are_neither_named_nor_invented(tmp_path):
    found = rates(tmp_path, {name: {"suspects": truth(case) or ["backlash"]} for name, case in CASES.items()})
    assert found["first_right"] == [0, SINGLE]
    assert found["only_suspected"] == [SINGLE, SINGLE]
    assert found["invented_on_clean"] == [0, CLEAN]


def test_what_fails_or_is_missing_is_not_right_and_stays_in_the_count(tmp_path):
    first = next(iter(CASES))
    found = rates(tmp_path, {first: {"failed": "diverged"}})
    assert found["first_right"] == [0, SINGLE]
    assert found["failed"] == [COUNT, COUNT]
    assert found["failures"] == {"diverged": 1, "no answer": COUNT - 1}
    assert found["median_seconds"] is None


@pytest.mark.parametrize(
    ("answers", "cases", "complaint"),
    [
        ({}, digest("other", draw("other", COUNT)), "another seed"),
        ({}, digest(SEED, CASES).replace("40-", "41-"), "another seed"),
        ({}, "nonsense", "another seed"),
        ({"nosuch": {}}, None, "no case called 'nosuch'"),
        ({next(iter(CASES)): {"names": ["friction"]}}, None, "not among the effects"),
        ({next(iter(CASES)): {"names": [[]]}}, None, "not among the effects"),
        ({next(iter(CASES)): {"names": [1]}}, None, "cannot be read"),
    ],
)
def test_answers_that_cannot_be_counted_are_refused_in_one_sentence(tmp_path, capsys, answers, cases, complaint):
    file = write(tmp_path / "answers.json", answers, cases=cases)
    with pytest.raises(UnusableInput, match=complaint):
        score([file], SEED)
    assert main(["recovery", "score", str(file), "--seed", SEED]) == 2
    assert complaint in capsys.readouterr().err


def test_tools_stand_side_by_side_on_the_same_cases_only(tmp_path, capsys):
    one, two = (write(tmp_path / f"{name}.json", {}, name) for name in ("one", "two"))
    assert main(["recovery", "score", str(one), str(two), "--seed", SEED, "--json", str(tmp_path / "rates.json")]) == 0
    assert "0 % (0 to 14)" in capsys.readouterr().out
    tables = rate_tables(json.loads((tmp_path / "rates.json").read_text()))
    assert [row[0].text for row in tables[0].rows] == ["one", "two"]
    with pytest.raises(UnusableInput, match="in the name of another tool"):
        score([one, one], SEED)
    fewer = write(tmp_path / "fewer.json", {}, "fewer", digest(SEED, draw(SEED, 4)))
    with pytest.raises(UnusableInput, match="the same cases"):
        score([one, fewer], SEED)


@pytest.mark.parametrize(("right", "total"), [(0, 5), (3, 7), (60, 72), (1, 1)])
def test_the_interval_is_that_of_scipy(right, total):
    theirs = binomtest(right, total).proportion_ci(method="wilson")
    assert wilson(right, total) == pytest.approx((theirs.low, theirs.high), abs=1e-6)
