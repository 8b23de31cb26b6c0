"""The recovery study runs like a suite: limits, rows for what fails, resume, and a digest of the code."""

from dataclasses import dataclass, replace

import pytest

from simgap.cli import main
from simgap.diagnosis import recovery as study
from simgap.diagnosis.cases import Case, CaseResult
from simgap.diagnosis.recovery import FILE, Grid, read, recovery
from simgap.records import UnusableInput
from simgap.reports import confusion
from simgap.running.execution import Execution

NOTHING_HIDDEN = Grid(rigs=("cart",), seeds=0, pairs=0, clean=2)


@dataclass(frozen=True)
class Chosen(Grid):
    """Cases of a test's own."""

    chosen: tuple[Case, ...] = ()

    def cases(self):
        return iter(self.chosen)


def run(out, grid=NOTHING_HIDDEN, **limits):
    """Results, and what was computed anew."""
    events = []
    results = recovery(grid, Execution(jobs=2, out=out, listener=events.append), **limits)
    return results, [row for event in events for row in event.finished]


def test_a_second_run_computes_nothing_and_one_with_other_code_everything(tmp_path, monkeypatch):
    first, computed = run(tmp_path)
    assert [row.verdict for row in first] == ["nothing_found", "nothing_found"]
    assert sorted(map(repr, first)) == sorted(map(repr, computed)) == sorted(map(repr, read(tmp_path / FILE)))
    again, computed = run(tmp_path)
    assert (again, computed) == (first, [])
    monkeypatch.setattr(study, "code_sha256", lambda: "0" * 64)
    other, computed = run(tmp_path)
    assert len(computed) == 2
    assert [row.code_sha256 for row in other] == ["0" * 64] * 2


@pytest.mark.slow
def test_a_torn_line_is_computed_again(tmp_path):
    first, _ = run(tmp_path)
    file = tmp_path / FILE
    file.write_bytes(b"no row at all\n" + file.read_bytes()[:-40])
    again, computed = run(tmp_path)
    assert len(computed) == 1
    assert [replace(row, seconds=0.0) for row in again] == [replace(row, seconds=0.0) for row in first]


@pytest.mark.parametrize(
    ("rig", "limits", "status", "message"),
    [
        ("nosuch", {}, "error", "there is no rig 'nosuch'"),
        ("cart", {"timeout": 0.2}, "timeout", "no result after 0.2 s"),
        ("cart", {"memory": 0.001}, "error", ""),
    ],
)
def test_a_case_that_raises_hangs_or_dies_is_a_row_and_is_computed_again(tmp_path, rig, limits, status, message):
    case = Case(rig, "dead_zone", 1.0, 0.05, 0.0, 1)
    for _ in range(2):
        (row,), computed = run(tmp_path, Chosen(chosen=(case,)), **limits)
        assert (row.case, row.status, computed) == (case, status, [row])
        assert message in row.message and row.message
        assert not row.right


def test_the_digest_covers_rigs_grey_box_and_diagnosis_and_nothing_that_only_shows_or_runs():
    modules = study.closure({"simgap.diagnosis.cases": None}, within=tuple(f"simgap.{r}" for r in study.ROOMS)).digests
    assert {
        "simgap.data.simulated.rigs", "simgap.data.simulated.rigs.kernels", "simgap.diagnosis.diagnose",
        "simgap.greybox.selection", "simgap.greybox.effects.backlash", "simgap.baselines.greybox",
    } <= set(modules)  # fmt: skip
    assert not [name for name in modules if name.startswith(("simgap.reports", "simgap.running", "simgap.cli"))]


def test_the_cases_are_those_of_the_grid():
    grid = Grid(rigs=("cart", "tank"), strengths=(1.0,), noises=(0.05,), pairs=2, clean=3, seeds=2)
    cases = list(grid.cases())
    assert len(set(cases)) == len(cases)
    assert sum("," in case.effects for case in cases) == 2
    assert sum(not case.effects for case in cases) == 3
    assert {case.seed for case in cases if case.effects and "," not in case.effects} == {0, 1}
    with pytest.raises(UnusableInput, match="no rig called 'nosuch'"):
        list(Grid(rigs=("nosuch",)).cases())


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--datasets", "nosuch"], "there is no rig called 'nosuch'"),
        (["--models", "arx"], "--models: the recovery study takes none"),
        (["--seeds", "0"], "give at least one seed"),
        (["--engine", "slurm"], "'slurm'"),
        (["--jobs", "0"], "at least one worker"),
    ],
)
def test_the_command_refuses_what_it_cannot_use(tmp_path, capsys, options, complaint):
    assert main(["run", "recovery", "--out", str(tmp_path / "out"), *options]) == 2
    assert complaint in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_summary_counts_what_was_named_and_the_picture_is_drawn(tmp_path):
    hidden = Case("cart", "dead_zone", 1.0, 0.05, 0.0, 1)
    seen = {"visible": True, "reference_gain": 0.5, "reference_ratio": 90.0, "verdict": "named", "gain": 0.4}
    results = [
        CaseResult(hidden, named=("dead_zone",), confounded=((),), **seen),
        CaseResult(replace(hidden, seed=2), named=("backlash",), confounded=((),), **seen),
        CaseResult(replace(hidden, seed=3), "timeout", "no result after 1 s"),
        CaseResult(replace(hidden, effects="", seed=4), verdict="nothing_found"),
    ]
    rows = [study.asdict(result) for result in results]
    figures = dict(confusion.summary(rows, [result.right for result in results]))
    assert figures["first name right, of the effects that the known-effect reference sees"] == "1 of 2 (50.0 %)"
    assert figures["nothing named where nothing is hidden"] == "1 of 1 (100.0 %)"
    assert figures["failed, left out"] == "1"
    confusion.picture(rows, tmp_path / "matrix.png")
    assert (tmp_path / "matrix.png").stat().st_size > 1000


@pytest.mark.parametrize(
    ("named", "confounded", "right"),
    [
        (("coulomb_friction", "dead_zone"), ((), ()), True),
        (("coulomb_friction", "backlash"), ((), ("dead_zone",)), True),
        (("coulomb_friction",), (("dead_zone",),), False),
        (("backlash", "stiction"), (("coulomb_friction", "dead_zone"), ()), False),
    ],
)
def test_each_of_two_hidden_effects_needs_an_answer_of_its_own(named, confounded, right):
    case = Case("stage", "coulomb_friction,dead_zone", 1.0, 0.02, 0.0, 0)
    assert CaseResult(case, verdict="named", named=named, confounded=confounded).right is right
