import math
from dataclasses import replace

import pytest

from simgap.reports.tables import dataset_table, overview, tidy


def column(table, heading):
    index = table.columns.index(heading)
    return {row[0].text: row[index].text for row in table.rows}


def best(table, heading):
    index = table.columns.index(heading)
    return [row[0].text for row in table.rows if row[index].best]


def test_the_overview_pools_the_test_experiments_and_puts_the_best_model_first(results):
    table = overview(results)
    pooled = 100 * (1 - math.sqrt((1.0**2 + 0.5**2) / 2) / 2)
    assert [row[0].text for row in table.rows] == ["arx", "mean", "gru"]
    assert column(table, "tanks") == {"arx": f"{pooled:.1f}", "mean": "0.0", "gru": "error [1]"}
    assert best(table, "tanks") == ["arx"]
    assert table.notes == ["error: fit raised MemoryError: [x] (gru.py, line 3)"]


def test_up_to_four_test_experiments_have_columns_of_their_own(results):
    table = dataset_table(results, "tanks")
    assert table.columns == [
        "model", "status", "RMSE level first [V]", "RMSE level second [V]", "fit %",
        "level 1/10/50 ahead [V]", "parameters", "fit s",
    ]  # fmt: skip
    assert column(table, "RMSE level second [V]") == {"arx": "0.5", "mean": "2", "gru": "-"}
    assert column(table, "level 1/10/50 ahead [V]")["arx"] == "0.1/0.5/0.9"
    assert column(table, "status")["gru"] == "error [1]"
    assert best(table, "RMSE level first [V]") == ["arx"]


def test_the_median_of_two_seeds_lies_between_them_in_every_column(make_row):
    table = dataset_table([make_row(rmse=rmse, seed=seed) for seed, rmse in enumerate((0.2, 0.4))], "tanks")
    assert column(table, "seeds") == {"arx": "2"}
    assert column(table, "RMSE level [V]") == {"arx": "0.3 (0.2 to 0.4)"}
    assert column(table, "fit %") == {"arx": "85.0 (80.0 to 90.0)"}


def test_seeds_of_different_code_are_said_to_be_so(make_row):
    rows = [make_row(rmse=0.2, seed=seed, provenance={"model_sha256": str(seed)}) for seed in range(2)]
    assert dataset_table(rows, "tanks").notes == ["The seeds of arx come from different versions of the code."]
    assert not dataset_table(rows[:1], "tanks").notes


def test_a_model_that_ran_on_few_data_sets_comes_after_those_that_ran_on_all(make_row):
    made = [("arx", 0.5, "a"), ("arx", 0.5, "b"), ("best", 0.1, "a"), ("mean", 9.0, "a"), ("mean", 0.4, "b")]
    rows = [replace(make_row(name, rmse=rmse), dataset=dataset) for name, rmse, dataset in made]
    table = overview(rows)
    assert [row[0].text for row in table.rows] == ["arx", "mean", "best"]
    assert any("more data sets come first" in note for note in table.notes)


def test_more_test_experiments_are_pooled_by_their_samples(make_row):
    rows = [make_row("arx", str(i), rmse=float(i), n=100 * (i + 1)) for i in range(5)]
    table = dataset_table(rows, "tanks")
    expected = math.sqrt(sum(100 * (i + 1) * i**2 for i in range(5)) / 1500)
    assert column(table, "RMSE level [V]") == {"arx": f"{expected:.4g}"}


def test_one_failed_experiment_spoils_the_pooled_figure(make_row):
    rows = [
        make_row("arx", "first", 1.0),
        make_row("arx", "second", math.inf, status="timeout", message="slow"),
    ]
    assert column(overview(rows), "tanks") == {"arx": "1 ok, 1 timeout [1]"}


def test_a_diverged_model_has_infinite_errors_and_is_never_best(make_row):
    rows = [make_row("arx", "test", math.inf, status="diverged", message="it grew")]
    table = dataset_table(rows, "tanks")
    assert column(table, "RMSE level [V]") == {"arx": "inf"}
    assert column(table, "fit %") == {"arx": "-inf"}
    assert best(table, "fit %") == []


def test_several_seeds_are_shown_as_median_and_range(make_row):
    rows = [make_row("gru", "test", rmse, seed=seed) for seed, rmse in enumerate((0.3, 0.1, 0.2))]
    assert column(dataset_table(rows, "tanks"), "RMSE level [V]") == {"gru": "0.2 (0.1 to 0.3)"}


def test_parameters_stand_in_the_name_only_where_a_model_has_several_sets(make_row):
    rows = [replace(make_row("arx"), params={"na": na, "nb": 1}) for na in (1, 2)] + [make_row("mean")]
    assert {row[0].text for row in overview(rows).rows} == {"arx (na=1, nb=1)", "arx (na=2, nb=1)", "mean"}


def test_warnings_of_a_good_fit_are_footnotes(make_row):
    table = overview([make_row("arx", message="RuntimeWarning: badly conditioned")])
    assert column(table, "tanks") == {"arx": "50.0 [1]"}
    assert table.notes == ["RuntimeWarning: badly conditioned"]


def test_results_from_two_versions_of_the_data_are_pointed_out(make_row):
    rows = [make_row(model, provenance={"data_sha256": model}) for model in ("arx", "mean")]
    assert "different versions" in dataset_table(rows, "tanks").notes[-1]


def test_models_that_miss_a_data_set_have_an_empty_cell(make_row):
    table = overview([make_row("arx"), replace(make_row("mean"), dataset="other")])
    assert column(table, "other") == {"arx": "", "mean": "50.0"}


def test_the_tidy_frame_has_one_row_per_result_and_output(results):
    frame = tidy(results)
    assert len(frame) == len(results)
    forecast = frame[frame.task == "forecast"].iloc[0]
    assert (forecast.rmse_10, forecast.rmse_all, forecast.unit) == (0.5, 1.0, "V")
    assert frame.rmse.max() == math.inf
    assert frame.fit_percent[2] == pytest.approx(50)
