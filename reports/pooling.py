"""Results brought together: over test experiments by sums of squares, over seeds by the median."""

from __future__ import annotations

import json
import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from simgap.metrics import pool, relative
from simgap.records import Result
from simgap.results.store import plain


@dataclass(frozen=True)
class Spread:
    """One figure from several seeds: its median and its range."""

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        """Sum up at least one value; infinities are values like others."""
        return cls(statistics.median(values), min(values), max(values))


@dataclass(frozen=True)
class Standing:
    """All results of one model with one set of parameters on one data set."""

    model: str
    dataset: str
    rows: tuple[Result, ...]

    def rmse(self, output: str, experiments: Sequence[str]) -> Spread | None:
        """Pool the free-run RMSE over the experiments, in the output's unit."""
        return self._spread(lambda rows: _pooled_rmse(rows, output), "free_run", experiments)

    def fit_percent(self) -> Spread | None:
        """Compute 100 (1 - sqrt(mean over the outputs of nrmse^2)) of the free run over all test experiments."""
        return self._spread(_pooled_fit, "free_run", ())

    @property
    def median_fit(self) -> float:
        """The median over the seeds of the fit in percent; minus infinity where there is none."""
        fit = self.fit_percent()
        return fit.median if fit else -math.inf

    def valid_fit(self) -> Spread | None:
        """Compute the fit in percent on the validation data; None where no row has one, -inf for a seed without."""
        of_seed = {row.seed: row.valid_nrmse for row in self.rows}
        if set(of_seed.values()) == {None}:
            return None
        return Spread.of([-math.inf if nrmse is None else 100 * (1 - nrmse) for nrmse in of_seed.values()])

    def rmse_at(self, output: str, horizon: str) -> Spread | None:
        """Pool the RMSE of the forecast `horizon` samples ahead, over the test experiments that are as long."""

        def at_horizon(rows: Sequence[Result]) -> float:
            figures = [_figures(row, output) for row in rows]
            if not all(figure.get("n_scored") for figure in figures):
                return math.inf
            known = [figure for figure in figures if horizon in figure.get("rmse_by_horizon", {})]
            values = [figure["rmse_by_horizon"][horizon] for figure in known]
            return pool(values, [figure["n_scored"] for figure in known]) if known else math.inf

        return self._spread(at_horizon, "forecast", ())

    def seconds(self) -> float | None:
        """Take the median time of a fit."""
        known = [row.fit_seconds for row in self.rows if row.fit_seconds is not None]
        return statistics.median(known) if known else None

    def n_params(self) -> int | None:
        """Take the largest number of estimated parameters among the seeds."""
        return max((row.n_params for row in self.rows if row.n_params is not None), default=None)

    @property
    def failed(self) -> bool:
        """Whether some result is missing, so that figures for all experiments cannot be given."""
        return any(row.status in ("error", "timeout") for row in self.rows)

    def problems(self) -> list[tuple[str, str]]:
        """List each status other than ok with its reason, and the warnings of those that are ok."""
        found = {(row.status, row.message): None for row in self.rows if row.status != "ok" or row.message}
        return list(found)

    def _spread(self, figure: Any, task: str, experiments: Sequence[str]) -> Spread | None:
        by_seed: dict[int, list[Result]] = {}
        for row in self.rows:
            if row.task == task and (not experiments or row.experiment in experiments):
                by_seed.setdefault(row.seed, []).append(row)
        return Spread.of([figure(rows) for rows in by_seed.values()]) if by_seed else None


def standings(results: Sequence[Result]) -> list[Standing]:
    """Sort results by model and data set. Parameters stand in a model's name where it has several sets."""
    groups: dict[tuple[str, str, str], list[Result]] = {}
    for row in results:
        params = json.dumps(plain(row.params), sort_keys=True)
        groups.setdefault((row.model, params, row.dataset), []).append(row)
    variants: dict[str, set[str]] = {}
    for model, params, _ in groups:
        variants.setdefault(model, set()).add(params)
    return [
        Standing(model if len(variants[model]) == 1 else _with_params(rows[0]), dataset, tuple(rows))
        for (model, _, dataset), rows in groups.items()
    ]


def _with_params(row: Result) -> str:
    listed = ", ".join(f"{name}={value}" for name, value in sorted(row.params.items()))
    return f"{row.model} ({listed})" if listed else row.model


def _figures(row: Result, output: str) -> dict[str, Any]:
    return row.metrics.get(output, {})


def _pooled_rmse(rows: Sequence[Result], output: str) -> float:
    figures = [_figures(row, output) for row in rows]
    if not all(figure.get("n_scored") for figure in figures):
        return math.inf  # one experiment without a simulation: there is no figure for all of them
    return pool([figure["rmse"] for figure in figures], [figure["n_scored"] for figure in figures])


def _pooled_fit(rows: Sequence[Result]) -> float:
    squares = []
    for output in rows[0].metrics:
        figures = [_figures(row, output) for row in rows]
        rmse = _pooled_rmse(rows, output)
        if math.isinf(rmse):
            return -math.inf
        std = pool([figure["std"] for figure in figures], [figure["n_scored"] for figure in figures])
        squares.append(relative(rmse, std)["nrmse"] ** 2)
    return 100 * (1 - math.sqrt(sum(squares) / len(squares))) if squares else -math.inf
