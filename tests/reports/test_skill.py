"""One figure over all data sets: skill against ARX and win rate, with intervals from the data sets."""

import math

import numpy as np
import pytest

from simgap.records import Result
from simgap.reports.leaderboard import tables_of
from simgap.reports.skill import skill_table


def rows(errors):
    """One free run of each model on each data set, with these errors in units of the output's spread."""
    return [
        Result(
            model, {}, f"set{i}", "e", "free_run", 0, "ok" if math.isfinite(error) else "error", n_params=7,
            fit_seconds=2.0, units={"y": ""},
            metrics={"y": {"rmse": error, "std": 1.0, "n_scored": 10} if math.isfinite(error) else {}},
        )
        for model, listed in errors.items() for i, error in enumerate(listed) if error is not None
    ]  # fmt: skip


def by_model(errors):
    table = skill_table(rows(errors))
    return {row[0].text: row for row in table.rows}


def test_skill_is_one_minus_the_geometric_mean_of_the_error_ratios():
    found = by_model({"arx": [0.2, 0.4, 0.1, 0.3], "lstm": [0.1, 0.1, 0.1, 0.6]})
    assert found["lstm"][1].value == pytest.approx(100 * (1 - (0.5 * 0.25 * 1 * 2) ** 0.25))
    assert found["arx"][1].text == "0.0 (0.0 to 0.0)"
    assert found["lstm"][2].value == pytest.approx(62.5)  # two wins and a draw
    assert [cell.text for cell in found["lstm"][3:]] == ["4 of 4", "7", "8"]


def test_a_failure_counts_a_hundredfold_and_what_was_not_run_not_at_all():
    found = by_model({"arx": [0.2, 0.2, 0.2, 0.2], "oe": [0.2, 0.2, 0.2, math.inf], "fir": [0.1, 0.1, 0.1, None]})
    assert found["oe"][1].value == pytest.approx(100 * (1 - 100 ** (1 / 4)))
    assert found["fir"][1].value == pytest.approx(50.0)
    assert found["fir"][3].text == "3 of 4"


def test_the_interval_holds_the_true_skill_as_often_as_it_promises():
    held = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        table = by_model({"arx": [0.2] * 20, "net": list(0.2 * 0.7 * np.exp(0.5 * rng.standard_normal(20)))})
        low, high = table["net"][1].text.split("(")[1].rstrip(")").split(" to ")
        held += float(low) <= 30.0 <= float(high)
    assert held >= 0.88 * 200


def test_there_is_no_such_table_without_arx_or_with_few_data_sets():
    assert skill_table(rows({"oe": [0.1, 0.2, 0.3]})) is None
    assert skill_table(rows({"arx": [0.1, 0.2], "oe": [0.1, 0.2]})) is None
    assert skill_table(rows({"arx": [0.1, 0.2, 0.3]})) is None
    both = rows({"arx": [0.1, 0.2, 0.3], "oe": [0.1, 0.2, 0.3]})
    assert any(table.title == "Skill over all data sets" for table in tables_of(both))


def test_where_arx_fails_too_nobody_gains():
    found = by_model({"arx": [0.2, 0.2, math.inf], "oe": [0.2, 0.2, math.inf]})
    assert found["oe"][1].value == pytest.approx(0.0)
