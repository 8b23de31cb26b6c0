"""The committed results are under test themselves: a leaderboard that nobody can regenerate is worth nothing."""

import json
import shutil
from pathlib import Path

import pytest

from simgap.data import available, load
from simgap.data.named import is_registered
from simgap.reports.leaderboard import report
from simgap.reports.recovery_rates import rate_tables
from simgap.reports.rendering import to_markdown
from simgap.results import store
from simgap.running.suites import load_suite, suite_names

RESULTS = Path(__file__).parents[2] / "reports" / "results"
FILES = sorted(RESULTS.glob("*/*.jsonl"))
RATES = RESULTS / "recovery" / "rates.json"


@pytest.fixture(scope="module")
def rows():
    return [row for file in FILES for row in store.read(file)]


def test_every_line_is_a_result_with_a_key_of_its_own(rows):
    lines = [line for file in FILES for line in file.read_text(encoding="utf-8").splitlines()]
    assert len(rows) == len(lines) > 0
    assert all(json.loads(line)["schema"] == 1 for line in lines)


def test_models_and_data_sets_are_known_and_scores_have_units_for_every_output(rows):
    assert {row.model for row in rows} <= {entry.label for name in suite_names() for entry in load_suite(name).models}
    assert all(map(is_registered, {row.dataset for row in rows}))
    assert all(row.units.keys() == row.metrics.keys() for row in rows)


def test_they_come_from_clean_commits(rows):
    assert not [
        row.provenance["commit"] for row in rows if not row.provenance["commit"] or "dirty" in row.provenance["commit"]
    ]


def test_they_come_from_the_measured_data_that_are_at_hand(rows):
    # The simulated gimbal may differ in its last bit from one processor to the next.
    at_hand = [name for name, why in available().items() if not why and not name.startswith("gimbal")]
    digests = {name: load(name).sha256 for name in at_hand}
    assert all(row.provenance["data_sha256"] == digests[row.dataset] for row in rows if row.dataset in digests)


def test_the_leaderboard_is_what_the_results_say(tmp_path):
    for file in (*FILES, RATES):
        (tmp_path / file.parent.name).mkdir(exist_ok=True)
        shutil.copy(file, tmp_path / file.parent.name)
    written = report(tmp_path).markdown.read_text(encoding="utf-8")
    assert written == (RESULTS / "leaderboard.md").read_text(encoding="utf-8")


def test_the_page_on_the_recovery_benchmark_shows_the_rates_that_are_stored():
    page = (RESULTS.parents[1] / "docs" / "recovery.md").read_text(encoding="utf-8")
    right, invented, _ = rate_tables(json.loads(RATES.read_bytes()))
    assert to_markdown(right, 3) in page
    assert to_markdown(invented, 3) in page
