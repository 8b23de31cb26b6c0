"""`simgap check`: what must be caught, and what must pass."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import t

import simgap
from simgap.baselines import arx
from simgap.cli import main
from simgap.records import Result, UnusableInput
from simgap.results import store
from simgap.results.regression import EVERYWHERE, ON_AVERAGE, compare

REFERENCE = Path(__file__).parents[2] / "reports" / "results"
GROWTH = (0.0, 0.2, -0.2, 0.1)  # of the RMSE of a network from seed to seed


def result(model, rmse, seed=0, experiment="test", **changes):
    metrics = {"y": {"rmse": rmse, "std": 2.0, "n_scored": 9, "rmse_by_horizon": {"1": rmse / 10}}}
    provenance = {"stochastic": model == "gru"}
    row = Result(model, {}, "toy", experiment, "free_run", seed, "ok", metrics=metrics, provenance=provenance)
    return replace(row, **changes)


def verdicts(before, after, suite="smoke"):
    return {(one.figure, one.seed): one.verdict for one in compare(suite, before, after)}


@pytest.mark.parametrize(
    ("factor", "verdict"),
    [
        (1.0, "same"),
        (1 + 9e-6, "same"),
        (1 + 2e-5, "worse"),
        (1.0001, "worse"),
        (0.9999, "better"),
        (math.inf, "worse"),
    ],
)
def test_a_model_that_computes_may_grow_by_a_hundred_thousandth(factor, verdict):
    found = verdicts([result("arx", 0.5)], [result("arx", 0.5 * factor)])
    assert found == {("test, free_run, y", 0): verdict, ("test, free_run, y 1 ahead", 0): verdict}


@pytest.mark.parametrize(("factor", "verdict"), [(1.04, "same"), (1.06, "worse"), (0.9, "better")])
def test_a_network_with_one_seed_may_grow_by_five_percent(factor, verdict):
    assert verdicts([result("gru", 0.5)], [result("gru", 0.5 * factor)])["test, free_run, y", 0] == verdict


def test_a_network_of_somebodys_own_may_grow_too_in_a_suite_that_nobody_knows():
    before, after = (result("mine", rmse, provenance={"stochastic": True}) for rmse in (0.5, 0.52))
    assert set(verdicts([before], [after], suite="theirs").values()) == {"same"}
    older = replace(before, provenance={})  # a reference from before models declared it
    assert set(verdicts([older], [after], suite="theirs").values()) == {"same"}
    assert set(verdicts([replace(before, provenance={"stochastic": False})], [after]).values()) == {"worse"}


@pytest.mark.parametrize(
    ("model", "params", "declared"),
    [
        ("arx", {}, False),
        ("gru", {"epochs": 1, "batches": 1}, True),
        ("delta", {"model": "gru", "params": {"epochs": 1, "batches": 1}}, True),
        ("delta", {}, False),
    ],
)
def test_a_row_says_whether_its_model_is_stochastic(model, params, declared):
    rows = simgap.fit(model, "gimbal_short", params).results
    assert {row.provenance["stochastic"] for row in rows} == {declared}


def test_a_network_may_grow_as_far_as_one_draw_of_its_seeds_exceeds_another_once_in_a_thousand():
    rng, alarms = np.random.default_rng(0), 0
    for _ in range(400):
        sizes = np.exp(0.1 * rng.standard_normal((2, 5)))
        before, after = ([result("gru", float(size), seed) for seed, size in enumerate(of_run)] for of_run in sizes)
        alarms += sum(one.verdict == "worse" for one in compare("smoke", before, after) if one.seed is not None)
    assert alarms <= 10  # 4 promised of 4,000
    before = [result("gru", 1 + growth, seed) for seed, growth in enumerate(GROWTH)]
    sigma = float(np.std([1 + growth for growth in GROWTH], ddof=1))
    for share, verdict in ((0.98, "same"), (1.02, "worse")):
        found = verdicts(before, [result("gru", 1 + 10.215 * math.sqrt(2) * sigma * share)])  # t(0.999; 3)
        assert found["test, free_run, y", 0] == verdict


def test_a_tenth_everywhere_is_found_where_another_processor_scatters_each_data_set():
    rng, found, alarms = np.random.default_rng(0), 0, 0
    for _ in range(100):
        sizes = np.exp(0.07 * rng.standard_normal((3, 9, 5)))  # as 0.1 of the changes

        def rows(sizes):
            every = ((k, seed) for k in range(9) for seed in range(5))
            return [replace(result("gru", float(sizes[k, seed]), seed), dataset=f"set{k}") for k, seed in every]

        before, same, worse = rows(sizes[0]), rows(sizes[1]), rows(1.1 * sizes[2])
        alarms += any(one.verdict == "worse" for one in compare("full", before, same) if one.dataset == EVERYWHERE)
        found += any(one.verdict == "worse" for one in compare("full", before, worse))
    assert found >= 95
    assert alarms <= 1


def test_a_tenth_on_all_rows_of_a_network_is_found_on_average_where_each_row_spreads_more():
    rng = np.random.default_rng(0)
    growth = rng.normal(0, 0.1, size=(4, 30))
    growth -= growth.mean(axis=1, keepdims=True)  # the seeds differ from row to row, hardly on average
    before = [result("gru", math.exp(growth[seed, i]), seed, str(i)) for seed in range(4) for i in range(30)]
    same = compare("smoke", before, [row for row in before if row.seed == 0])
    assert {one.verdict for one in same} == {"same"}
    after = [result("gru", 1.1 * math.exp(growth[0, i]), 0, str(i)) for i in range(30)]
    wrong = [one for one in compare("smoke", before, after) if one.verdict == "worse"]
    assert ON_AVERAGE in {one.figure for one in wrong}


def test_a_tenth_is_found_however_far_the_seeds_of_the_reference_spread():
    before = [result("gru", size, seed) for seed, size in enumerate((0.5, 1.0, 2.0))]
    after = [replace(row, metrics=result("gru", 1.1 * row.metrics["y"]["rmse"]).metrics) for row in before]
    assert ON_AVERAGE in {one.figure for one in compare("smoke", before, after) if one.verdict == "worse"}


def test_one_seed_on_one_data_set_may_have_become_another_seed_of_the_reference():
    before = [result("gru", size, seed) for seed, size in enumerate((0.8, 1.0, 1.2))]
    assert not [one for one in compare("smoke", before, [result("gru", 1.2)]) if one.verdict == "worse"]


def test_seeds_that_another_processor_leads_astray_are_no_loss_on_average():
    rng, alarms = np.random.default_rng(0), 0
    for _ in range(2000):
        sizes = np.exp(0.2 * rng.standard_normal((2, 3)))
        before, after = ([result("gru", float(size), seed) for seed, size in enumerate(of_run)] for of_run in sizes)
        found = compare("smoke", before, after)
        alarms += any(one.figure == ON_AVERAGE and one.verdict == "worse" for one in found)
    assert alarms <= 6  # 2 promised


def test_a_row_that_is_gone_is_missing_and_a_seed_that_was_not_run_is_not():
    before = [result("arx", 1.0), result("arx", 1.0, 0, "other"), result("gru", 1.0), result("gru", 1.1, 1)]
    found = compare("smoke", before, [result("arx", 1.0), result("gru", 1.0)])
    assert [(one.model, one.figure) for one in found if one.verdict == "missing"] == [("arx", "other, free_run")]


def test_a_row_that_failed_says_why_and_one_that_no_longer_diverges_is_better():
    failed = result("arx", math.inf, status="error", message="fit raised", metrics={"y": {"rmse": math.inf}})
    (worse, missing) = compare("smoke", [result("arx", 1.0)], [failed])
    assert (worse.verdict, worse.why, missing.verdict) == ("worse", "fit raised", "missing")
    diverged = result("arx", math.inf, status="diverged", metrics={"y": {"rmse": math.inf}})
    assert [one.verdict for one in compare("smoke", [diverged], [diverged])] == ["same"]
    assert "better" in {one.verdict for one in compare("smoke", [diverged], [result("arx", 1.0)])}


def test_new_models_are_counted_and_do_no_harm():
    assert verdicts([result("arx", 1.0)], [result("arx", 1.0), result("mine", 9.0)])[ON_AVERAGE, None] == "new"


def test_rounding_of_an_exact_model_is_no_regression():
    found = verdicts([result("arx", 1e-15)], [result("arx", 3e-15)])
    assert set(found.values()) == {"same"}


def test_the_command_prints_markdown_and_ends_with_1_for_worse_and_0_for_same(tmp_path, capsys):
    store.append(tmp_path / "reference", "smoke", [result("arx", 1.0), result("<b>|x", 1.0)])
    store.append(tmp_path / "new", "smoke", [result("arx", 1.1), result("<b>|x", 1.0)])
    files = ["--markdown", str(tmp_path / "table.md"), "--json", str(tmp_path / "table.json")]
    assert main(["check", str(tmp_path / "reference"), "--reference", str(tmp_path / "reference")]) == 0
    assert "none of 4 figures is worse or missing" in capsys.readouterr().out
    assert main(["check", str(tmp_path / "new"), "--reference", str(tmp_path / "reference"), *files]) == 1
    printed = capsys.readouterr().out
    assert "2 worse and 0 missing of 4 figures" in printed
    assert "| arx | toy | test, free\\_run, y | 0 | 1 | 1.1 | 1.00001 | worse |" in printed
    assert "<b>" not in printed
    assert (tmp_path / "table.md").read_text() in printed
    assert json.loads((tmp_path / "table.json").read_text())["passed"] is False


def test_a_recovery_study_beside_the_suites_is_not_compared(tmp_path):
    for folder in ("reference", "new"):
        store.append(tmp_path / folder, "smoke", [result("arx", 1.0)])
        (tmp_path / folder / "recovery").mkdir()
        (tmp_path / folder / "recovery" / "cases.jsonl").write_text('{"case": 1}\n')
    assert not simgap.check(tmp_path / "new", tmp_path / "reference").wrong


def test_a_deterministic_model_may_grow_as_far_as_its_seeds_do_once_in_a_thousand():
    before = [result("arx", 0.5 + 1e-3 * by, seed) for seed, by in enumerate(GROWTH)]
    reach = 0.5 + t.ppf(0.999, 3) * math.sqrt(2) * 1e-3 * np.std(GROWTH, ddof=1)
    for rmse, verdict in ((reach - 1e-6, "same"), (reach + 1e-6, "worse")):
        assert verdicts(before, [result("arx", rmse)])["test, free_run, y", 0] == verdict


@pytest.mark.parametrize(
    ("new", "reference", "complaint"),
    [
        ("nosuch", "reference", "there is no folder"),
        ("reference", "nosuch", "there is no folder"),
        ("other", "reference", "holds no results of full"),
        ("empty", "reference", "holds no results of any suite"),
    ],
)
def test_what_cannot_be_compared_is_refused(tmp_path, new, reference, complaint):
    store.append(tmp_path / "reference", "smoke", [result("arx", 1.0)])
    store.append(tmp_path / "other", "full", [result("arx", 1.0)])
    (tmp_path / "empty").mkdir()
    with pytest.raises(UnusableInput, match=complaint):
        simgap.check(tmp_path / new, tmp_path / reference)


@pytest.fixture(scope="module")
def reference():
    """`reference("arx")` are the committed rows of that model on the small data set."""
    rows = store.read(REFERENCE / "smoke")
    return lambda model: [row for row in rows if row.model == model]


def test_the_committed_results_are_met_again_by_arx_and_a_planted_bug_of_1e_4_is_found(reference, monkeypatch):
    def compared():
        return compare("smoke", reference("arx"), simgap.fit("arx", "gimbal_short").results)

    assert {one.verdict for one in compared()} == {"same"}
    honest = arx.estimate_arx

    def planted(*arguments):
        fit = honest(*arguments)
        return replace(fit, polynomial=replace(fit.polynomial, b=fit.polynomial.b * (1 + 1e-4)))

    monkeypatch.setattr(arx, "estimate_arx", planted)
    assert "worse" in {one.verdict for one in compared()}


def test_a_planted_loss_of_a_tenth_of_grus_accuracy_is_found(reference):
    def grown(row, factor):
        figures = {
            output: values | {"rmse": values["rmse"] * factor}
            | {name: {h: v * factor for h, v in values[name].items()} for name in values if name == "rmse_by_horizon"}
            for output, values in row.metrics.items()
        }  # fmt: skip
        return replace(row, metrics=figures)

    rows = reference("gru")
    assert len({row.seed for row in rows}) >= 3
    run = [row for row in rows if row.seed == 0]
    assert {one.verdict for one in compare("smoke", rows, run)} == {"same"}
    assert "worse" in {one.verdict for one in compare("smoke", rows, [grown(row, 1.1) for row in run])}
