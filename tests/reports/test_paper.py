import io
import math
import runpy
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from simgap.reports.leaderboard import brief, report, tables_of
from simgap.reports.paper.tables import LABELS, NAMES, PRINTED, SPOKEN_OF, of_paper, paper_tables, pooled_mse, rises
from simgap.reports.rendering import to_markdown, to_rich
from simgap.results import store
from simgap.running.suites import load_suite

EXAMPLE = runpy.run_path(str(Path(__file__).with_name("example_paper.py")))
PHI = "MSE of phi on contiguous set [deg²]"


@pytest.fixture
def figures():
    return EXAMPLE["figures"]()


def make(figures, seed=0):
    return EXAMPLE["rows"](figures, seed)


def column(table, heading):
    index = table.columns.index(heading)
    return {row[0].text: row[index] for row in table.rows}


def marked(table, heading):
    cells = column(table, heading)
    return [name.split(" (")[0] for mark in ("best", "second") for name, c in cells.items() if getattr(c, mark)]


@pytest.mark.parametrize(
    ("table", "label", "heading", "figure"),
    [
        (1, "SRNN delta", "MSE train", 0.0203),
        (1, "TCNs-L2 delta", "R² valid", 0.8055),
        (1, "LSTM delta", "best epoch", 24),
        (2, "CONV1D delta", "MSE of phi_dot on contiguous set", 28478.17),
        (2, "ARMAX2221 delta", "MSE of phi on delta set", 54.81),
        (3, "TCNs-dropout", "MAE train", 0.1053),
        (3, "TCNs-dropout", "best epoch", 20),
        (4, "GRU-LSTM-CONV1D-reg", "MSE of phi on contiguous set", 1835.28),
        (4, "ARX221", "MSE of phi_dot on contiguous set", 4954.90),
    ],
)
def test_the_printed_figures_are_those_of_the_paper(table, label, heading, figure):
    assert PRINTED[table - 1].rows[label][heading] == figure


def test_the_labels_are_those_of_the_suite():
    assert {*LABELS, *SPOKEN_OF} == {entry.label for entry in load_suite("paper").models}
    assert {label.removesuffix(" delta") for label in LABELS} == set(NAMES)


def test_best_and_second_best_are_those_the_paper_marks():
    found = [{c: marked(t, f"paper: {c}") for c in p.columns} for p, t in zip(PRINTED, paper_tables([]), strict=True)]
    assert found[0]["MSE train"] == ["Model 9", "Model 10a"]
    assert found[0]["MAE train"] == ["Model 10a", "Model 9"]
    assert found[0]["R² valid"] == ["Model 6", "Model 5"]
    assert found[0]["epochs"] == []
    assert found[1]["MSE of phi on delta set"] == ["Model 5", "Model 6"]  # ARMAX2221 is lower and no network
    assert found[1]["MSE of phi_dot on contiguous set"] == ["Model 7", "Model 2"]
    assert found[2]["MAE valid"] == ["Model 6", "Model 10b"]
    assert found[3]["MSE of phi_dot on contiguous set"] == ["Model 6", "Model 10b"]


def test_the_mse_is_pooled_by_the_samples_of_the_test_experiments(figures):
    rows = [row for row in make({"GRU": figures["GRU"]}) if row.task == "free_run"]
    first, second = (row.metrics["phi"]["mse"] for row in rows)
    assert pooled_mse(rows, "phi") == pytest.approx((100 * first + 300 * second) / 400) == pytest.approx(2014.50)
    assert pooled_mse([], "phi") is None


def test_our_figures_stand_in_the_columns_of_the_paper(figures):
    tables = paper_tables(make(figures))
    for printed, table in zip(PRINTED, tables, strict=True):
        n = len(printed.columns)
        assert len(table.columns) == 2 + 2 * n
        for row, values in zip(table.rows, printed.rows.values(), strict=True):
            for name, cell, theirs in zip(printed.columns, row[2:], row[2 + n :], strict=False):
                assert (cell.value == pytest.approx(values[name])) if name in values else theirs.text == "/"
    assert column(tables[1], PHI)["ARX321"].text == "1"  # which the paper does not give


def test_of_several_seeds_the_median_and_the_range_are_shown(figures):
    rows = []
    for seed, mse in enumerate((3000.0, 1000.0, 2000.0)):
        figures["GRU"]["MSE of phi on contiguous set"] = mse
        rows += make(figures, seed)
    cell = column(paper_tables(rows)[3], PHI)["Model 2 (GRU)"]
    assert (cell.text, cell.value) == ("2000 (1000 to 3000)", pytest.approx(2000))


def test_models_without_results_have_a_row_that_says_so(figures):
    tables = paper_tables(make({"GRU": figures["GRU"]}))
    assert [len(table.rows) for table in tables] == [10, 12, 10, 12]
    table = tables[3]
    assert column(table, "status")["Model 1 (SRNN)"].text == "missing"
    assert column(table, PHI)["Model 1 (SRNN)"].text == ""
    assert column(table, "status")["Model 2 (GRU)"].text == "ok"
    assert marked(table, PHI) == ["Model 2"]


def test_a_diverged_model_has_infinite_errors_and_is_never_marked(figures):
    rows = [_broken(row, math.inf, 100, status="diverged", message="it grew") for row in make({"GRU": figures["GRU"]})]
    table = paper_tables(rows)[3]
    assert column(table, "status")["Model 2 (GRU)"].text == "diverged [1]"
    assert column(table, PHI)["Model 2 (GRU)"].text == "inf"
    assert marked(table, PHI) == []
    assert table.notes[0] == "diverged: it grew"


def test_a_failed_model_has_no_figures_and_its_reason_as_a_footnote(figures):
    failed = {"status": "error", "message": "no | memory", "fitted": {}, "n_params": None}
    rows = [_broken(row, math.inf, 0, **failed) for row in make({"GRU": figures["GRU"]})]
    tables = paper_tables(rows)
    assert column(tables[3], PHI)["Model 2 (GRU)"].text == "-"
    assert column(tables[2], "MSE train")["Model 2 (GRU)"].text == "-"
    assert "no \\| memory" in to_markdown(tables[3])


def test_one_failed_seed_leaves_the_figures_of_the_others(figures):
    rows = make({"GRU": figures["GRU"]})
    rows += [_broken(replace(row, seed=1), math.inf, 0, status="error", fitted={}) for row in rows]
    table = paper_tables(rows)[3]
    assert column(table, "status")["Model 2 (GRU)"].text.startswith("4 ok, 4 error")
    assert column(table, PHI)["Model 2 (GRU)"].text == "2014.5"


def test_of_two_sets_of_parameters_the_last_is_shown_and_the_other_is_mentioned(figures):
    gru = {"GRU": figures["GRU"]}
    earlier = make(gru)
    gru["GRU"] = gru["GRU"] | {"MSE of phi on contiguous set": 7.0}
    table = paper_tables(earlier + [replace(row, params={"window": 20}) for row in make(gru)])[3]
    assert column(table, PHI)["Model 2 (GRU)"].text == "7"
    assert "several sets of parameters, of which the last are shown: GRU" in table.notes[-1]


def test_a_loss_that_only_falls_has_no_rises():
    assert rises([3.0, 2.0, 1.0]) == 0
    assert rises([2.0, 1.0, 1.5, 1.0]) == pytest.approx(0.5 / 3)


def test_the_second_best_is_in_italics_and_labels_are_escaped(figures):
    text = to_markdown(paper_tables(make(figures))[3])
    assert "| **1793.3** |" in text
    assert "| *1835.3* |" in text
    assert "MSE of phi\\_dot on contiguous set \\[(deg/s)²\\]" in text


def test_on_a_terminal_the_best_is_bold_the_second_best_underlined_and_long_names_wrap(figures):
    console = Console(file=io.StringIO(), width=120, force_terminal=True, color_system="standard")
    console.print(to_rich(paper_tables(make(figures))[3], 120))
    text = console.file.getvalue()
    assert "\x1b[1m1793.3\x1b[0m" in text
    assert "\x1b[4m1835.3\x1b[0m" in text
    assert "Model 6 (GRU-LSTM-CONV1D in  " in text
    assert "Not shown" not in text


def test_the_suite_is_known_by_its_labels_and_others_get_no_such_tables(figures, results):
    assert of_paper(make({"GRU": figures["GRU"]}))
    assert not of_paper(results)
    titles = [table.title for table in tables_of(make(figures))]
    assert [title.partition(":")[0] for title in titles] == [
        "Table 1", "Table 2", "Table 3", "Table 4", "The paper's claims", "Free-run fit in percent", "gimbal",
    ]  # fmt: skip
    assert len(tables_of(results)) == 2
    assert [table.title for table in brief(make(figures))] == [*titles[:5], "gimbal"]
    assert [table.title for table in brief(results)] == ["tanks"]


def test_the_page_of_a_stored_suite_holds_the_tables_and_the_claims(figures, tmp_path):
    store.append(tmp_path, "paper", make(figures))
    page = report(tmp_path).markdown.read_text(encoding="utf-8")
    assert page.index("### Table 1: ") < page.index("### The paper's claims") < page.index("### Free-run fit")


def _broken(row, mse, n_scored, **more):
    metrics = {output: f | {"mse": mse, "rmse": mse, "n_scored": n_scored} for output, f in row.metrics.items()}
    return replace(row, metrics=metrics, **more)
