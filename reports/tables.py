"""Results as tables: an overview of all models on all data sets, and one table per data set."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import pandas as pd

from simgap.records import Result
from simgap.reports.error_ratios import HOW_IT_IS_MADE, HOW_TO_READ, ErrorRatio, Ratios
from simgap.reports.pooling import Spread, Standing, standings
from simgap.results.store import plain
from simgap.wording import number

# More test experiments than these are pooled into one column.
COLUMNS_PER_EXPERIMENT = 4
HORIZONS = ("1", "10", "50")
LOWEST_FIT = -100.0  # percent, as far as a fit counts in the order of the models
ORDER = "Models that ran on more data sets come first; of those that ran on as many, the one with the higher mean fit."
FIGURES = ("rmse", "nrmse", "fit_percent", "r2", "mse", "mae", "std", "n_scored")


@dataclass(frozen=True)
class Cell:
    """One entry: its text, and the number by which the best of a column, or the second best, is found.

    Second best is, where errors were compared, what chance cannot tell from the best.
    """

    text: str
    value: float | None = None
    best: bool = False
    second: bool = False


@dataclass(frozen=True)
class Table:
    """What is rendered for the terminal and as Markdown. Every text may come from a stranger's data set."""

    title: str
    columns: list[str]
    rows: list[list[Cell]]
    notes: list[str] = field(default_factory=list)


def tidy(results: Sequence[Result]) -> pd.DataFrame:
    """Lay out one row per result and output, one column per figure; horizons as rmse_1, rmse_2, ... rmse_all."""
    rows = []
    for result in results:
        about = {
            "model": result.model, "params": json.dumps(plain(result.params), sort_keys=True),
            "dataset": result.dataset, "experiment": result.experiment, "task": result.task,
            "seed": result.seed, "status": result.status,
        }  # fmt: skip
        last = {
            "valid_nrmse": result.valid_nrmse, "n_params": result.n_params, "fit_seconds": result.fit_seconds,
            "simulate_seconds": result.simulate_seconds, "message": result.message,
        }  # fmt: skip
        for output, figures in result.metrics.items():
            ahead = {f"rmse_{h}": rmse for h, rmse in figures.get("rmse_by_horizon", {}).items()}
            single = {name: figures.get(name) for name in FIGURES}
            unit = result.units.get(output, "")
            rows.append(about | {"output": output, "unit": unit} | single | ahead | last)
    return pd.DataFrame(rows)


def overview(results: Sequence[Result], ratios: Ratios | None = None) -> Table:
    """Make a table of the fit in percent of the free run: models down, data sets across, the best model first.

    `ratios` of errors to those of the best row mark what cannot be told from it.
    """
    ratios = ratios or {}
    found = standings(results)
    datasets = sorted({standing.dataset for standing in found})
    notes = Notes()
    rows = []
    for model in dict.fromkeys(s.model for s in found):
        mine = {s.dataset: s for s in found if s.model == model}
        cells = [
            _fit_cell(mine[name], notes, _undecided(ratios.get(name), model)) if name in mine else Cell("")
            for name in datasets
        ]
        rows.append([Cell(model), *cells])
    rows.sort(key=lambda row: _by_fit([cell.value for cell in row[1:]]), reverse=True)
    for column in range(1, len(datasets) + 1):
        _mark_best(rows, column, max)
    order = [ORDER] if len(datasets) > 1 else []
    how_made = [HOW_IT_IS_MADE] if any(ratios.values()) else []
    return Table("Free-run fit in percent", ["model", *datasets], rows, notes.texts + order + how_made)


def _by_fit(fits: Sequence[float | None]) -> tuple[int, float]:
    """Count the data sets of a model, and average its fits; one that diverges must not decide alone."""
    known = [max(fit, LOWEST_FIT) for fit in fits if fit is not None]
    return len(known), sum(known) / max(len(known), 1)


def dataset_table(results: Sequence[Result], dataset: str, ratios: Mapping[str, ErrorRatio] | None = None) -> Table:
    """Make a table of RMSE, fit, RMSE by horizon, size and time of all models on one data set, the best first.

    `ratios` of errors to those of the best row, by model, have a column of their own where there are any.
    """
    found = [standing for standing in standings(results) if standing.dataset == dataset]
    rows_of = [row for standing in found for row in standing.rows]
    units, groups = units_of(rows_of), experiment_groups(rows_of)
    horizons = _horizons(rows_of)
    notes = Notes()
    found.sort(key=lambda standing: _or_worst(_median(standing.fit_percent())), reverse=True)
    several = len({row.seed for row in rows_of}) > 1
    rows = []
    for standing in found:
        errors = [
            spread_cell(standing.rmse(output, group), ".4g", standing.failed) for group in groups for output in units
        ]
        ahead = [_ahead(standing, output, horizons) for output in units if horizons]
        size, seconds = standing.n_params(), standing.seconds()
        rows.append([
            Cell(standing.model), Cell(status_of(standing) + notes.of(standing)), *_seeds_cell(standing, several),
            *errors, *_fit_cells(standing, ratios), *ahead,
            Cell("" if size is None else str(size)), Cell("" if seconds is None else number(seconds, 2)),
        ])  # fmt: skip
    columns = _columns(units, groups, horizons, bool(ratios), several)
    first, fit = columns.index("status") + 1 + several, columns.index("fit %")
    for column in range(first, fit):
        _mark_best(rows, column, min)
    _mark_best(rows, fit, max)
    how_to_read = [HOW_TO_READ] if ratios else []
    return Table(dataset, columns, rows, [*notes.texts, *how_to_read, *warnings_of(rows_of)])


def units_of(rows: Sequence[Result]) -> dict[str, str]:
    """List the outputs with their units."""
    return {output: row.units.get(output, "") for row in rows for output in row.metrics}


def experiment_groups(rows: Sequence[Result]) -> list[list[str]]:
    """Group the test experiments into those of one figure each: a few stand apart, many are pooled."""
    experiments = list(dict.fromkeys(row.experiment for row in rows))
    return [[e] for e in experiments] if 1 < len(experiments) <= COLUMNS_PER_EXPERIMENT else [experiments]


def warnings_of(rows: Sequence[Result]) -> list[str]:
    """Say what is wrong with rows of one data set in one table."""
    said = []
    if len({row.provenance.get("data_sha256") for row in rows}) > 1:
        said.append("These rows come from different versions of the data set; run the suite again.")
    mixed = [
        standing.model for standing in standings(rows)
        if len({row.provenance.get("model_sha256") for row in standing.rows}) > 1
    ]  # fmt: skip
    if mixed:
        said.append(f"The seeds of {', '.join(mixed)} come from different versions of the code.")
    return said


class Notes:
    """Footnotes of one table, numbered as they come; one text has one number."""

    def __init__(self) -> None:
        self.texts: list[str] = []

    def of(self, standing: Standing) -> str:
        """Give the marks of all problems of a standing, such as " [1] [2]"."""
        marks = ""
        for status, message in standing.problems():
            text = message if status == "ok" else f"{status}: {message}"
            if text not in self.texts:
                self.texts.append(text)
            marks += f" [{self.texts.index(text) + 1}]"
        return marks


def spread_cell(spread: Spread | None, form: str, failed: bool) -> Cell:
    """Write the median, and the range where the seeds differ."""
    if spread is None:
        return Cell("")
    if failed and math.isinf(spread.median):
        return Cell("-", spread.median)
    text, low, high = (format(figure, form) for figure in (spread.median, spread.low, spread.high))
    if low != high:
        text += f" ({low} to {high})"
    return Cell(text, spread.median)


def _fit_cell(standing: Standing, notes: Notes, undecided: bool) -> Cell:
    cell = spread_cell(standing.fit_percent(), "z.1f", standing.failed)
    text = status_of(standing) if cell.text == "-" else cell.text
    return replace(cell, text=text + notes.of(standing), second=undecided)


def _undecided(ratios: Mapping[str, ErrorRatio] | None, model: str) -> bool:
    return bool(ratios) and model in ratios and ratios[model].undecided


def _fit_cells(standing: Standing, ratios: Mapping[str, ErrorRatio] | None) -> list[Cell]:
    """Write the fit in percent and, where errors were compared, the ratio to the best row's."""
    fit = spread_cell(standing.fit_percent(), "z.1f", standing.failed)
    if not ratios:
        return [fit]
    one = ratios.get(standing.model)
    ratio = Cell(str(one), one.ratio) if one else Cell("")
    return [replace(fit, second=_undecided(ratios, standing.model)), ratio]


def _seeds_cell(standing: Standing, several: bool) -> list[Cell]:
    return [Cell(str(len({row.seed for row in standing.rows})))] if several else []


def _ahead(standing: Standing, output: str, horizons: Sequence[str]) -> Cell:
    medians = [_median(standing.rmse_at(output, horizon)) for horizon in horizons]
    if medians == [None] * len(medians):
        return Cell("")
    if standing.failed and math.inf in medians:
        return Cell("-")
    return Cell("/".join("" if value is None else f"{value:.3g}" for value in medians))


def status_of(standing: Standing) -> str:
    """Write the status of all rows, or how many have which."""
    counts = {status: 0 for status in ("ok", "diverged", "error", "timeout")}
    for row in standing.rows:
        counts[row.status] += 1
    present = [status for status, count in counts.items() if count]
    return present[0] if len(present) == 1 else ", ".join(f"{counts[status]} {status}" for status in present)


def _mark_best(rows: list[list[Cell]], column: int, best_of: Callable[[list[float]], float]) -> None:
    values = [row[column].value for row in rows]
    finite = [value for value in values if value is not None and math.isfinite(value)]
    for row in rows:
        if finite and row[column].value == best_of(finite):
            row[column] = replace(row[column], best=True)


def _horizons(rows: Sequence[Result]) -> list[str]:
    present = {h for row in rows for figures in row.metrics.values() for h in figures.get("rmse_by_horizon", {})}
    return [horizon for horizon in HORIZONS if horizon in present]


def _columns(
    units: Mapping[str, str], groups: Sequence[Sequence[str]], horizons: Sequence[str], compared: bool, several: bool
) -> list[str]:
    columns = ["model", "status", "seeds"] if several else ["model", "status"]
    for group in groups:
        columns += [_heading(output, unit, group, len(groups)) for output, unit in units.items()]
    columns += ["fit %", "error / best"] if compared else ["fit %"]
    if horizons:
        steps = "/".join(horizons)
        columns += [with_unit(f"{output} {steps} ahead", unit) for output, unit in units.items()]
    return [*columns, "parameters", "fit s"]


def _heading(output: str, unit: str, experiments: Sequence[str], n_groups: int) -> str:
    return with_unit(f"RMSE {output} {experiments[0]}" if n_groups > 1 else f"RMSE {output}", unit)


def with_unit(name: str, unit: str) -> str:
    """Write a name with its unit, if it has one."""
    return f"{name} [{unit}]" if unit else name


def _median(spread: Spread | None) -> float | None:
    return None if spread is None else spread.median


def _or_worst(value: float | None) -> float:
    return -math.inf if value is None or not math.isfinite(value) else value
