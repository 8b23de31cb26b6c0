"""The paper's four tables: the figures of the suite `paper` beside those that are printed there."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from simgap.records import Result
from simgap.reports.pooling import Spread, Standing, standings
from simgap.reports.tables import Cell, Notes, Table, spread_cell, status_of, warnings_of

FILE = Path(__file__).parent / "paper.toml"
DATASET = "gimbal"
OUTPUTS = ("phi", "phi_dot")
SETS = {"differences": "delta", "free_run": "contiguous"}  # a task, and what the paper calls the set it is scored on
UNMARKED = ("epochs", "best epoch")

Values = dict[str, float]  # a figure per column


@dataclass(frozen=True)
class Printed:
    """One table as the paper prints it: the figures of its rows by label and column, without those it leaves out."""

    title: str
    decimals: int
    columns: tuple[str, ...]
    rows: dict[str, Values]


def _read() -> tuple[dict[str, str], list[Printed]]:
    with FILE.open("rb") as file:
        source = tomllib.load(file)
    tables = [
        Printed(table["title"], table["decimals"], tuple(table["columns"]), {
            label: {c: float(figure) for c, figure in zip(table["columns"], row, strict=True) if figure != "/"}
            for label, row in table["rows"].items()
        })
        for table in source["table"]
    ]  # fmt: skip
    return source["names"], tables


NAMES, PRINTED = _read()
LABELS = tuple(dict.fromkeys(label for table in PRINTED for label in table.rows))
SPOKEN_OF = ("small", "small-reg", "GRU-LSTM-CONV1D-last")  # labels of networks that the paper has claims about only


def paper_tables(results: Sequence[Result]) -> list[Table]:
    """Make Tables 1 to 4 of the paper, ours and its own figures; every model has a row, whatever became of it."""
    rows_of = rows_by_label(results)
    stored = [standing.rows[0].model for standing in standings(_ours_of(results))]
    doubled = sorted({label for label in stored if stored.count(label) > 1})
    note = f"Stored with several sets of parameters, of which the last are shown: {', '.join(doubled)}."
    tables = [_table(printed, rows_of) for printed in PRINTED]
    return [replace(table, notes=[*table.notes, note]) for table in tables] if doubled else tables


def of_paper(results: Sequence[Result]) -> bool:
    """Tell whether results are of the suite `paper`: models with its labels, scored on differences of the gimbal."""
    return any(row.task == "differences" for rows in rows_by_label(results).values() for row in rows)


def rows_by_label(results: Sequence[Result], labels: Sequence[str] = LABELS) -> dict[str, tuple[Result, ...]]:
    """Sort rows by the paper's models; of several sets of parameters, the one that comes last counts."""
    return {standing.rows[0].model: standing.rows for standing in standings(_ours_of(results, labels))}


def values_by_seed(rows: Sequence[Result]) -> dict[int, Values]:
    """Collect the figures of one model for each seed, by the paper's columns; columns without a figure are left out."""
    seeds = sorted({row.seed for row in rows})
    return {seed: _values([row for row in rows if row.seed == seed]) for seed in seeds}


def values_by_condition(results: Sequence[Result]) -> dict[str, dict[int, Values]]:
    """Collect the figures of models of the crossover study, by label and seed; a column names its data set."""
    found: dict[str, dict[int, Values]] = {}
    for standing in standings(results):
        for seed in {row.seed for row in standing.rows}:
            rows = [row for row in standing.rows if row.seed == seed]
            about, values = rows[0].fitted, found.setdefault(standing.rows[0].model, {}).setdefault(seed, {})
            here = {f"MSE of {output}": pooled_mse(rows, output) for output in OUTPUTS}
            learned = {part: about[part] for part in ("train", "valid") if isinstance(about.get(part), dict)}
            here |= {f"MSE {part}": figures.get("mse") for part, figures in learned.items()}
            values |= {f"{column} on {standing.dataset}": mse for column, mse in here.items() if mse is not None}
    return found


def pooled_mse(rows: Sequence[Result], output: str) -> float | None:
    """Compute sum(n MSE) / sum(n) over test experiments; None when one of them was not simulated."""
    figures = [row.metrics.get(output, {}) for row in rows]
    if not figures or not all(figure.get("n_scored") for figure in figures):
        return None
    return sum(f["n_scored"] * f["mse"] for f in figures) / sum(f["n_scored"] for f in figures)


def rises(losses: Sequence[float]) -> float:
    """Average max(0, L(k+1) - L(k)) over the epochs k, relative to the lowest loss: 0 for a loss that only falls."""
    ups = [max(0.0, later - earlier) for earlier, later in pairwise(losses)]
    return sum(ups) / len(ups) / min(losses)


def _ours_of(results: Sequence[Result], labels: Sequence[str] = LABELS) -> list[Result]:
    return [row for row in results if row.dataset == DATASET and row.model in labels]


def _values(rows: Sequence[Result]) -> Values:
    found = {
        f"MSE of {output} on {where} set": pooled_mse([row for row in rows if row.task == task], output)
        for task, where in SETS.items() for output in OUTPUTS
    }  # fmt: skip
    about = rows[0].fitted
    for part in ("train", "valid"):
        learned = about.get(part)
        if isinstance(learned, dict):
            found |= {f"{name} {part}": learned.get(name.lower().replace("²", "2")) for name in ("MSE", "MAE", "R²")}
    found |= {"epochs": about.get("epochs"), "best epoch": about.get("best_epoch"), "parameters": rows[0].n_params}
    found["reach"] = about.get("reach")
    losses = about.get("valid_loss") or []
    found["rises"] = rises(losses) if len(losses) > 2 and min(losses) > 0 else None
    return {column: float(value) for column, value in found.items() if isinstance(value, int | float)}


def _table(printed: Printed, rows_of: dict[str, tuple[Result, ...]]) -> Table:
    notes = Notes()
    shown = [row for label in printed.rows for row in rows_of.get(label, ())]
    columns = [_with_unit(column, shown) for column in printed.columns]
    theirs = [f"paper: {column}" for column in printed.columns]
    rows = []
    for label, figures in printed.rows.items():
        mine = rows_of.get(label, ())
        standing = Standing(label, DATASET, mine)
        rows.append([
            Cell(NAMES[label.removesuffix(" delta")]),
            Cell(status_of(standing) + notes.of(standing) if mine else "missing"),
            *(_ours(standing, column) for column in printed.columns),
            *(_theirs(figures.get(column), column, printed.decimals) for column in printed.columns),
        ])  # fmt: skip
    n_networks = sum(row[0].text.startswith("Model ") for row in rows)
    networks, classical = rows[:n_networks], rows[n_networks:]
    for i, column in enumerate((*printed.columns, *printed.columns), start=2):
        if column not in UNMARKED:
            _mark(networks, i, -1 if column.startswith("R²") else 1)
    about = _about(printed, shown, bool(classical))
    return Table(printed.title, ["model", "status", *columns, *theirs], rows, notes.texts + about)


def _ours(standing: Standing, column: str) -> Cell:
    if not standing.rows:
        return Cell("")
    values = [found[column] for found in values_by_seed(standing.rows).values() if column in found]
    if not values:
        return Cell("-")
    form = "z.4f" if column.startswith("R²") else ".5g" if " on " in column else ".4g"
    return spread_cell(Spread.of(values), form, standing.failed)


def _theirs(figure: float | None, column: str, decimals: int) -> Cell:
    if figure is None:
        return Cell("/")
    return Cell(f"{figure:.{0 if column in UNMARKED else decimals}f}", figure)


def _mark(rows: list[list[Cell]], column: int, sign: int) -> None:
    """Mark the lowest of sign * value and the second lowest."""
    values = {sign * v for row in rows if (v := row[column].value) is not None and math.isfinite(v)}
    best, second, *_ = *sorted(values), None, None
    for row in rows:
        cell = row[column]
        if cell.value is not None:
            row[column] = replace(cell, best=sign * cell.value == best, second=sign * cell.value == second)


def _with_unit(column: str, rows: Sequence[Result]) -> str:
    """Head a column with its unit; mean squares of an output have its unit, squared."""
    output = next((output for output in OUTPUTS if f" {output} " in column), "")
    unit = next((row.units[output] for row in rows if row.units.get(output)), "")
    if not unit:
        return column
    return f"{column} [({unit})²]" if "/" in unit else f"{column} [{unit}²]"


def _about(printed: Printed, rows: Sequence[Result], classical: bool) -> list[str]:
    """Say what one has to know to read the table."""
    seeds = len({row.seed for row in rows})
    texts = [
        "Ours were scored on simulated recordings of the gimbal, because the paper's are not public: compare the "
        "order of the models, not the magnitudes.",
        f"Ours: {f'median (range) of {seeds} seeds' if seeds > 1 else 'one seed'}; the paper has one training of each "
        f"model. The best {'network ' if classical else ''}of a column is bold, the second best in italics (underlined "
        "on a terminal).",
    ]
    if not classical:
        texts.append(
            "On data scaled to -1 to 1 by the range of the training data, with the weights of the best epoch and "
            "without dropout; how the paper's figures were taken is not said there."
        )
    else:
        texts.append(
            "Pooled over the test experiments, in physical units; the paper prints no units. The networks see no "
            "measured output, but the sums of those trained on the delta set start at the last measured sample; ARX "
            "and ARMAX start from measured samples."
        )
    if "MSE of phi on delta set" in printed.columns:
        texts.append("Contiguous: the predicted differences, summed up. Where a / stands, the paper gives no figure.")
    return texts + warnings_of(rows)
