"""Cases of a seed: nothing but the seed tells what is hidden."""

import json
from collections import Counter
from dataclasses import replace

import pytest
from scipy.stats import chi2_contingency

from simgap.data import load, save
from simgap.diagnosis.cases import room_of
from simgap.records import UnusableInput
from simgap.recovery import make_cases
from simgap.recovery.drawing import CARD, PATTERN, digest, draw, effects

SEED = "a seed of the tests"


@pytest.fixture(scope="module")
def many():
    return draw(SEED, 2000)


def test_a_seed_gives_the_same_cases_again_and_another_seed_others():
    assert draw(SEED, 40) == draw(SEED, 40)
    assert not set(draw(SEED, 40)) & set(draw("another", 40))
    assert digest(SEED, draw(SEED, 40)) != digest("another", draw("another", 40))
    assert set(draw(SEED, 20)) < set(draw(SEED, 40))


def test_every_effect_is_hidden_as_often_as_any_other(many):
    singles = Counter(case.effects for case in many.values() if case.effects in effects())
    assert set(singles) == set(effects())
    assert max(singles.values()) - min(singles.values()) <= 1
    assert sum(singles.values()) == 2000 * PATTERN.count("single") // len(PATTERN)


def test_neither_place_nor_machine_nor_noise_says_whether_something_is_hidden(many):
    listed = [(place, case) for place, case in enumerate(many.values()) if case.effects in ("", *effects())]
    for of in (
        lambda place, case: place // 200,
        lambda place, case: round(case.noise, 2),
        lambda place, case: case.colour > 0,
    ):
        table = Counter((of(place, case), bool(case.effects)) for place, case in listed)
        groups = sorted({group for group, _ in table})
        counts = [[table[group, hidden] for group in groups] for hidden in (False, True)]
        assert chi2_contingency(counts).pvalue > 1e-3
    machines = Counter((case.rig, bool(case.effects)) for _, case in listed)
    often = [rig for rig in {rig for rig, _ in machines} if machines[rig, True] > 20]
    counts = [[machines[rig, hidden] for rig in often] for hidden in (False, True)]
    assert chi2_contingency(counts).pvalue > 1e-3


def test_a_case_looks_like_the_same_machine_with_nothing_hidden_in_it(tmp_path):
    cases = make_cases(SEED, 6, tmp_path / "cases")
    for name, case in cases.items():
        twin = replace(case, effects="")
        clean = room_of(case.rig).hide(case.rig, twin.hidden(), case.noise, case.colour, case.seed)
        save(replace(clean, name=name), tmp_path / "clean" / name)
        files, others = (
            {path.relative_to(folder): path for path in sorted(folder.rglob("*.*"))}
            for folder in (tmp_path / "cases" / name, tmp_path / "clean" / name)
        )
        assert list(files) == list(others)
        for file, path in files.items():
            lines, same = path.read_text().splitlines(), others[file].read_text().splitlines()
            assert (len(lines), lines[0]) == (len(same), same[0])
            assert file.suffix == ".csv" or lines == same


def test_no_file_holds_the_seed_or_the_machine_or_what_is_hidden(tmp_path):
    cases = make_cases(SEED, 6, tmp_path / "cases")
    card = json.loads((tmp_path / "cases" / CARD).read_text())
    assert card["names"] == sorted(cases) == sorted(p.name for p in (tmp_path / "cases").iterdir() if p.is_dir())
    assert card["effects"] == list(effects())
    assert set(card) == {"schema", "cases", "names", "effects"}
    for name, case in cases.items():
        text = (tmp_path / "cases" / name / "dataset.toml").read_text()
        assert not any(word in text for word in (SEED, str(case.seed), f'"{case.rig}"', *case.hidden()))
        assert load(str(tmp_path / "cases" / name)).name == name


@pytest.mark.parametrize(("seed", "count", "complaint"), [(" ", 3, "--seed"), ("a", 0, "--cases 0")])
def test_what_cannot_be_drawn_is_refused(tmp_path, seed, count, complaint):
    with pytest.raises(UnusableInput, match=complaint):
        make_cases(seed, count, tmp_path / "cases")
    assert not (tmp_path / "cases").exists()


def test_a_folder_that_holds_something_is_refused(tmp_path):
    (tmp_path / "mine.txt").touch()
    with pytest.raises(UnusableInput, match="is not empty"):
        make_cases(SEED, 2, tmp_path)
