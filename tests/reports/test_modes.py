"""The table that compares networks with a state to networks on windows."""

from simgap.records import Result
from simgap.reports.modes import modes_table


def row(model, dataset, nrmse):
    figures = {"rmse": nrmse, "nrmse": nrmse, "mse": nrmse**2, "std": 1.0, "n_scored": 10}
    return Result(model, {}, dataset, "test", "free_run", 0, "ok", {"y": figures}, {"y": "V"})


def test_it_counts_for_how_many_networks_a_state_is_better():
    rows = [
        row("gru", "tanks", 0.2), row("gru windowed", "tanks", 0.5), row("lstm", "tanks", 0.4),
        row("lstm windowed", "tanks", 0.3), row("tcn", "tanks", 0.1), row("tcn windowed", "tanks", 0.3),
        row("arx", "tanks", 0.05),
    ]  # fmt: skip
    table = modes_table(rows)
    assert [cell.text for cell in table.rows[0]] == ["tanks", "80.0", "70.0", "90.0", "70.0", "2 of 3"]
    assert [cell.best for cell in table.rows[0]][:3] == [False, True, False]


def test_without_both_modes_there_is_no_table():
    assert modes_table([row("gru", "tanks", 0.2), row("lstm windowed", "tanks", 0.3)]) is None
