"""The row that a user who has no test data would choose, and what it is worth on the test."""

from __future__ import annotations

from collections.abc import Sequence

from simgap.records import Result
from simgap.reports.pooling import Standing, standings
from simgap.reports.tables import Cell, Table, experiment_groups, spread_cell, units_of

HOW_TO_READ = (
    "Rows: how many have an error on the validation data. Chosen: the one whose free run errs least on them, in the "
    "median over its seeds, estimated on the training data alone with all else as validation data chose it; that of an "
    "ensemble, whose weights are estimated on them, is cross-validated. The test had no part in it. RMSE and fit: on "
    "the test, of the row as committed, estimated on the validation data too where a model does that. With several "
    "seeds: median (range). Best on the test: found with the test, which nobody can do in practice."
)


def chosen_table(results: Sequence[Result]) -> Table | None:
    """Make a table of the row that validation data choose on each data set, the best on the test beside it."""
    by_dataset: dict[str, list[Standing]] = {}
    for standing in standings(results):
        by_dataset.setdefault(standing.dataset, []).append(standing)
    rows = [row for dataset, found in sorted(by_dataset.items()) if (row := _row(dataset, found))]
    columns = ["data set", "rows", "chosen", "seeds", "validation fit %", "RMSE on the test", "fit %",
               "best on the test", "its fit %"]  # fmt: skip
    return Table("The row that validation data choose", columns, rows, [HOW_TO_READ]) if rows else None


def _row(dataset: str, found: Sequence[Standing]) -> list[Cell] | None:
    known = {standing.model: (fit, standing) for standing in found if (fit := standing.valid_fit()) is not None}
    if not known:
        return None
    fit, chosen = max(known.values(), key=lambda pair: pair[0].median)
    best = max(found, key=lambda standing: standing.median_fit)
    seeds = len({row.seed for row in chosen.rows})
    return [
        Cell(dataset), Cell(f"{len(known)} of {len(found)}"), Cell(chosen.model), Cell(f"{seeds}"),
        spread_cell(fit, "z.1f", False), Cell(_errors(chosen)),
        spread_cell(chosen.fit_percent(), "z.1f", chosen.failed),
        Cell(best.model, best=best is chosen), spread_cell(best.fit_percent(), "z.1f", best.failed),
    ]  # fmt: skip


def _errors(standing: Standing) -> str:
    groups, units = experiment_groups(standing.rows), units_of(standing.rows)
    texts = []
    for group in groups:
        for output, unit in units.items():
            where = [name for name, several in ((output, len(units) > 1), (group[0], len(groups) > 1)) if several]
            cell = spread_cell(standing.rmse(output, group), ".3g", standing.failed)
            texts.append(" ".join([*where, cell.text, unit]).strip())
    return "; ".join(texts)
