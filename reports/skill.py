"""One figure per model over all data sets: its skill against ARX and how often it wins, with intervals."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from simgap.records import Result
from simgap.reports.pooling import Standing, standings
from simgap.reports.tables import Cell, Table
from simgap.wording import number

AGAINST = "arx"
FEWEST = 3  # data sets
LARGEST_RATIO = 100.0  # of errors, up and down: one simulation that diverges must not decide alone
RESAMPLINGS = 2000


def skill_table(results: Sequence[Result]) -> Table | None:
    """Rank models by their skill over the data sets; None where ARX and another were not run on three of them.

        skill = 1 - geometric mean over data sets of RMSE / RMSE of ARX,   win rate: share of the others' errors above

    with the median RMSE of the seeds, pooled over outputs in units of their spread, ratios within 1/100 and 100, and
    95 % intervals by bootstrap over the data sets (Shchur et al., fev-bench, 2025; Efron and Tibshirani 1993). The
    error of a seed that failed is infinite; a data set on which a model was not run is not counted.
    """
    found: dict[str, list[Standing]] = {}
    for standing in standings(results):
        found.setdefault(standing.model, []).append(standing)
    errors = {model: _errors(listed) for model, listed in found.items()}
    of_arx = errors.get(AGAINST, {})
    datasets = sorted(of_arx)
    models = [model for model, known in errors.items() if len(known.keys() & of_arx.keys()) >= FEWEST]
    if len(models) < 2:
        return None
    table = np.array([[errors[model].get(dataset, math.nan) for dataset in datasets] for model in models])  # [M, D]
    logs = np.log(_bounded(table, table[models.index(AGAINST)]))
    wins = np.array([_wins(table, i) for i in range(len(models))])
    draws = np.random.default_rng(0).integers(len(datasets), size=(RESAMPLINGS, len(datasets)))
    rows = []
    for i, model in enumerate(models):
        skill, of_skill = _with_interval(logs[i], draws, lambda mean: 100 * (1 - np.exp(mean)))
        rate, of_rate = _with_interval(wins[i], draws, lambda mean: 100 * mean)
        seconds = sum(standing.seconds() or 0.0 for standing in found[model])
        sizes = [size for standing in found[model] if (size := standing.n_params()) is not None]
        rows.append([
            Cell(model), Cell(of_skill, skill), Cell(of_rate, rate),
            Cell(f"{np.sum(~np.isnan(table[i]))} of {len(datasets)}"),
            Cell(f"{statistics.median_low(sizes)}" if sizes else ""), Cell(number(seconds, 2), seconds),
        ])  # fmt: skip
    rows.sort(key=lambda row: -(row[1].value or 0.0))
    notes = [
        "Skill: 100 (1 - geometric mean over data sets of the model's free-run error divided by that of ARX), a ratio "
        "within 1/100 and 100. Win rate: on how many percent of data sets and other rows of this table, networks on "
        "windows among them, its error is the smaller one. In brackets: 95 %, by bootstrap over data sets; few of them "
        "make it wide. Parameters: median; seconds of fitting: of all data sets together, one seed, the median of "
        "seeds that ran on machines of different speed."
    ]
    columns = ["model", "skill %", "win rate %", "data sets", "parameters", "fit s"]
    return Table("Skill over all data sets", columns, rows, notes)


def _errors(of_model: Sequence[Standing]) -> dict[str, float]:
    """Collect the error of a model on each data set, in units of the outputs' spread."""
    fits = {standing.dataset: standing.fit_percent() for standing in of_model}
    return {dataset: 1 - fit.median / 100 for dataset, fit in fits.items() if fit is not None}


def _bounded(errors: np.ndarray, against: np.ndarray) -> np.ndarray:
    """Divide errors and keep the ratios within bounds; two that are equal, failures too, have the ratio 1."""
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.where(errors == against, 1.0, errors / against)
    return np.clip(ratio, 1 / LARGEST_RATIO, LARGEST_RATIO)


def _wins(table: Float[np.ndarray, "M D"], i: int) -> Float[np.ndarray, " D"]:
    """Compute on each data set the share of the other models that a model beats; a draw is half a win."""
    others = np.delete(table, i, axis=0)
    known = ~np.isnan(others) & ~np.isnan(table[i])
    points = np.where(known, (table[i] < others) + 0.5 * (table[i] == others), 0.0).sum(axis=0)
    count = known.sum(axis=0)
    return np.where(count > 0, points / np.maximum(count, 1), math.nan)


def _with_interval(
    values: Float[np.ndarray, " D"], draws: np.ndarray, figure: Callable[[np.ndarray], np.ndarray]
) -> tuple[float, str]:
    """Average over the data sets that are known, and write it with its interval."""
    drawn = values[draws]
    known = ~np.isnan(drawn)
    drawn = np.where(known, drawn, 0.0).sum(axis=1)[known.any(axis=1)] / known.sum(axis=1)[known.any(axis=1)]
    mean = float(figure(np.asarray(np.nanmean(values))))
    low, high = sorted(np.percentile(figure(drawn), (2.5, 97.5)))
    return mean, f"{mean:z.1f} ({low:z.1f} to {high:z.1f})"
