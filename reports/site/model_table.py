"""The rows of one model over all data sets as a table."""

from __future__ import annotations

import math
from collections.abc import Sequence

from simgap.reports.pooling import Standing
from simgap.reports.tables import HORIZONS, Cell, Notes, Table, spread_cell, status_of
from simgap.wording import number

COLUMNS = [
    "data set", "status", "fit %", "output", "unit", "RMSE", *(f"{h} ahead" for h in HORIZONS), "parameters", "fit s"
]  # fmt: skip


def model_table(found: Sequence[Standing], title: str) -> Table:
    """Make a table with a row per data set and output: fit, RMSE of free run and forecasts, size and time."""
    notes = Notes()
    rows = []
    for standing in sorted(found, key=lambda standing: standing.dataset):
        fit = spread_cell(standing.fit_percent(), "z.1f", standing.failed)
        size, seconds = standing.n_params(), standing.seconds()
        status = status_of(standing) + notes.of(standing)
        units = {output: row.units.get(output, "") for row in standing.rows for output in row.metrics}
        for output, unit in units.items():
            rows.append([
                Cell(standing.dataset), Cell(status), fit, Cell(output), Cell(unit or "not stated"),
                spread_cell(standing.rmse(output, ()), ".4g", standing.failed),
                *(_ahead(standing, output, horizon) for horizon in HORIZONS),
                Cell("" if size is None else str(size)),
                Cell("" if seconds is None else number(seconds, 2)),
            ])  # fmt: skip
    return Table(title, COLUMNS, rows, notes.texts)


def _ahead(standing: Standing, output: str, horizon: str) -> Cell:
    known = any(
        horizon in row.metrics.get(output, {}).get("rmse_by_horizon", {}) for row in standing.rows
        if row.task == "forecast"
    )  # fmt: skip
    spread = standing.rmse_at(output, horizon) if known else None
    if spread is None or not math.isfinite(spread.median):
        return Cell("" if spread is None else "-")
    return Cell(f"{spread.median:.3g}", spread.median)
