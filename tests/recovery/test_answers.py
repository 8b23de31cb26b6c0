"""Adapters answer cases on the engines; what fails is an answer too."""

import json

import pytest

from simgap.cli import main
from simgap.data.simulated.rigs import hide
from simgap.records import UnusableInput
from simgap.recovery import answer, make_cases
from simgap.recovery.answers import read_answers
from simgap.registry import ADAPTERS
from simgap.running.execution import Execution


@pytest.fixture
def cases(tmp_path):
    return tmp_path / "cases", list(make_cases("a seed of the tests", 2, tmp_path / "cases"))


def test_a_case_that_fails_says_why_and_is_asked_again(cases, tmp_path):
    folder, (broken, whole) = cases
    toml = folder / broken / "dataset.toml"
    toml.rename(tmp_path / "away")
    events = []
    first = answer(folder, tmp_path / "a.json", "frols", Execution(listener=events.append)).answers
    assert "dataset.toml" in first[broken].failed
    assert not first[whole].failed
    assert first[whole].seconds > 0
    (tmp_path / "away").rename(toml)
    events.clear()
    second = answer(folder, tmp_path / "a.json", "frols", Execution(listener=events.append))
    assert [name for event in events for name, _ in event.finished] == [broken]
    assert second.answers[whole] == first[whole]
    assert not second.answers[broken].failed
    assert read_answers(tmp_path / "a.json") == second


def test_unusable_arguments_are_refused_before_any_work(cases, tmp_path, capsys):
    folder, _ = cases
    card = json.loads((folder / "cases.json").read_text())
    (tmp_path / "theirs.json").write_text(json.dumps({"tool": "theirs", "cases": card["cases"], "answers": {}}))
    for arguments, complaint in (
        ((tmp_path,), "cases.json; make cases"),
        ((folder, "--tool", "nosuch"), "no adapter called 'nosuch'"),
        ((folder, "--out", tmp_path / "theirs.json"), "answers of 'theirs'"),
        ((folder, "--out", tmp_path / "no" / "a.json"), "a folder that exists"),
    ):
        assert main(["recovery", "answer", *map(str, arguments)]) == 2
        assert complaint in capsys.readouterr().err
    with pytest.raises(UnusableInput, match="cannot be read"):
        (tmp_path / "torn.json").write_text("{")
        read_answers(tmp_path / "torn.json")


def named(tool, effect):
    return ADAPTERS[tool](hide("cart", {effect: 1.0} if effect else {}, noise=0.02, seed=5))["names"]


def test_a_delay_of_four_samples_shows_in_the_terms_of_a_narx():
    assert named("frols", "input_delay")[0] == ["input_delay"]


@pytest.mark.slow
@pytest.mark.parametrize(("tool", "effects"), [("odd_even", ("coulomb_friction", "asymmetric_gain")),
                                               ("sindy", ("quadratic_drag", "dead_zone"))])  # fmt: skip
def test_an_adapter_names_what_is_plain_to_see_and_nothing_in_a_clean_cart(tool, effects):
    for effect in effects:
        first = named(tool, effect)[0]
        assert effect == first or effect in first
    assert named(tool, "") == []
