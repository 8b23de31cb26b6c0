import pandas as pd
import pytest

import simgap
from simgap.records import UnusableInput
from simgap.reports.published import published_tables
from simgap.results import store


def test_a_report_has_a_section_per_suite_and_one_for_what_others_published(results, tmp_path):
    store.append(tmp_path, "smoke", results)
    store.append(tmp_path, "full", results[:1])
    report = simgap.report(tmp_path)
    assert list(report.tables) == ["full", "smoke"]
    page = report.markdown.read_text()
    headings = [line for line in page.splitlines() if line.startswith("## ")]
    assert headings == ["## Suite full", "## Suite smoke", "## Published by others"]
    ours, _, others = page.partition("## Published by others")
    assert "SUBNET" not in ours
    assert "arXiv:2405.10779" in others
    assert "Scored: nonlinear" in others
    assert len(pd.read_csv(report.csv)) == len(results) + 1


def test_the_folder_of_one_suite_can_be_reported_by_itself(results, tmp_path):
    store.append(tmp_path, "smoke", results)
    assert list(simgap.report(tmp_path / "smoke").tables) == ["smoke"]


def test_a_folder_without_results_is_refused(tmp_path):
    with pytest.raises(UnusableInput, match="holds no results"):
        simgap.report(tmp_path)
    with pytest.raises(UnusableInput, match="there is no folder"):
        simgap.report(tmp_path / "nosuch")


def test_a_damaged_file_is_refused_with_its_line(results, tmp_path):
    store.append(tmp_path, "smoke", results[:1])
    with store.path_of(tmp_path, "smoke", "mean").open("a") as file:
        file.write("{}\n")
    with pytest.raises(UnusableInput, match=r"mean\.jsonl, line 2: the field 'model' is missing"):
        simgap.report(tmp_path)


def test_every_published_row_has_a_figure_for_each_column_and_a_source():
    tables = published_tables()
    assert len(tables) >= 3
    for table in tables:
        assert all(len(row) == len(table.columns) for row in table.rows)
        assert "arXiv" in table.notes[0]
        assert "Scored" in table.notes[0]
