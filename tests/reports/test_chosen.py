"""The table of the rows that validation data choose."""

from simgap.records import Result
from simgap.reports.chosen import chosen_table


def row(model, nrmse, valid, experiment="test", seed=0):
    figures = {"rmse": 2 * nrmse, "nrmse": nrmse, "mse": 4 * nrmse**2, "std": 2.0, "n_scored": 10}
    return Result(
        model, {}, "tanks", experiment, "free_run", seed, "ok", {"level": figures}, {"level": "V"}, valid_nrmse=valid
    )


def test_the_row_that_errs_least_on_validation_data_is_chosen_whatever_the_test_says():
    table = chosen_table([row("oe", 0.3, 0.2), row("arx", 0.1, 0.4), row("mean", 1.0, None)])
    assert [cell.text for cell in table.rows[0]] == [
        "tanks", "2 of 3", "oe", "1", "80.0", "0.6 V", "70.0", "arx", "90.0",
    ]  # fmt: skip


def test_the_median_over_the_seeds_decides_and_a_seed_that_diverged_counts_as_the_worst():
    lucky = [row("gru", 0.3, valid, seed=seed) for seed, valid in enumerate((0.01, None, None))]
    steady = [row("lstm", 0.2, valid, seed=seed) for seed, valid in enumerate((0.1, 0.2, 0.3))]
    cells = chosen_table(lucky + steady).rows[0]
    assert cells[2].text == "lstm"
    assert cells[4].text == "80.0 (70.0 to 90.0)"
    assert cells[7].best


def test_a_few_test_experiments_have_an_error_each():
    table = chosen_table([row("oe", 0.3, 0.2, "slow"), row("oe", 0.4, 0.2, "fast")])
    assert table.rows[0][5].text == "slow 0.6 V; fast 0.8 V"


def test_rows_without_an_error_on_validation_data_make_no_table():
    assert chosen_table([row("oe", 0.3, None)]) is None
