"""Results against a reference, row by row: what became worse, and by how much it might have."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Literal

from scipy.stats import t as student

from simgap.records import Result, UnusableInput
from simgap.results import store

Change = Literal["same", "better", "worse", "missing", "new"]

# Share by which an RMSE may grow: of a deterministic model, several times what rounding on another processor moves it,
# and of a stochastic one; more where its seeds spread more.
COMPUTED = 1e-5
STOCHASTIC = 0.05
ALARM = 0.001  # chance of one where nothing but rounding changed
# Share of the spread of what was measured below which an RMSE is rounding.
ROUNDING = 1e-9
ENDLESS = 300.0  # logarithm of a growth that few seeds cannot tell from their own spread
ON_AVERAGE = "on average"
EVERYWHERE = "all data sets"

FigureName = tuple[str, str, str]  # experiment, task, and output with its horizon


@dataclass(frozen=True)
class Comparison:
    """One RMSE before and after, in the output's unit, and the limit above which it is worse.

    The figure `on average` is the geometric mean over all RMSEs of a model on a data set, or on all; their units do not
    matter as it is only compared with itself. None: there is none.
    """

    suite: str
    model: str
    dataset: str
    figure: str
    seed: int | None
    before: float | None
    after: float | None
    limit: float
    verdict: Change
    why: str = ""


@dataclass(frozen=True)
class Regression:
    """All comparisons, and what a reader should know besides."""

    comparisons: tuple[Comparison, ...]
    notes: tuple[str, ...] = ()

    @property
    def wrong(self) -> list[Comparison]:
        """What is worse or missing."""
        return [one for one in self.comparisons if one.verdict in ("worse", "missing")]


def check(new: str | Path, reference: str | Path = Path("reports") / "results") -> Regression:
    """Compare the results in a folder with those of a reference, suite by suite.

    An RMSE is worse when it exceeds the reference by more than one of two draws exceeds the other once in a thousand,

        t(0.999; n - 1) sqrt(2) sigma of n seeds,

    and by more than 1e-5 of it, or 5 % where the model declares itself stochastic. The seeds of a deterministic model
    differ by how rounding falls (`simgap.running.rounding`), as another processor does; there a long training makes
    another draw of every seed. What that hides shows on average: the geometric mean of the RMSEs per model and data
    set, and over all data sets, is worse by more than 5 % and more than the changes of the same seeds scatter
    (Student's paired t); of a single one, more than two draws may differ. A row of the reference is missing when the
    new results lack it although they have its seed. Raises UnusableInput.
    """
    new, reference = Path(new), Path(reference)
    for folder in (new, reference):
        if not folder.is_dir():
            raise UnusableInput(f"there is no folder {folder}; `simgap run` makes one with results")
    suites = [path.name for path in store.suites_in(new)]
    known = [name for name in suites if any((reference / name).glob("*.jsonl"))]
    if not known:
        raise UnusableInput(f"{reference} holds no results of {', '.join(suites) or 'any suite'}; nothing to compare")
    comparisons: list[Comparison] = []
    notes = [f"suite {name} is not in the reference and was not compared" for name in suites if name not in known]
    for suite in known:
        before, after = store.read(reference / suite), store.read(new / suite)
        comparisons += compare(suite, before, after)
        notes += _other_data(before, after)
    return Regression(tuple(comparisons), tuple(notes))


def compare(suite: str, before: Sequence[Result], after: Sequence[Result]) -> list[Comparison]:
    """All comparisons of a suite, model by model and data set by data set."""
    theirs, ours = _grouped(before), _grouped(after)
    seeds = {row.seed for row in after}
    comparisons: list[Comparison] = []
    everywhere: dict[tuple[str, str], list[_Group]] = {}
    for group, rows in theirs.items():
        model, params, dataset = group
        compared = _Group(suite, model, dataset, rows, ours.get(group, []))
        comparisons += compared.row_by_row(seeds)
        if compared.pairs:
            comparisons.append(compared.judged_on_average(compared.pairs))
            everywhere.setdefault((model, params), []).append(compared)
    for groups in everywhere.values():
        if len(groups) > 1:
            pairs = [pair for one in groups for pair in one.pairs]
            comparisons.append(replace(groups[0], dataset=EVERYWHERE).judged_on_average(pairs))
    for group in ours.keys() - theirs.keys():
        comparisons.append(Comparison(suite, group[0], group[2], ON_AVERAGE, None, None, None, math.inf, "new"))
    return comparisons


@dataclass(frozen=True)
class _Group:
    """The rows of one model on one data set, before and after."""

    suite: str
    model: str
    dataset: str
    before: list[Result]
    after: list[Result]

    def row_by_row(self, seeds: set[int]) -> Iterator[Comparison]:
        """Every figure of every row of the reference whose seed was run."""
        after = {store.key(row): row for row in self.after}
        for row in self.before:
            if row.seed not in seeds:
                continue
            now = after.get(store.key(row))
            if now is None:
                yield self._comparison(f"{row.experiment}, {row.task}", row.seed, None, None, math.inf, "missing",
                                       "no such row")  # fmt: skip
                continue
            figures = _figures(now)
            for name, (value, scale) in _figures(row).items():
                limit = value + self._allowed(value, *self._spread.get(name, (0.0, 1)), scale)
                figure = ", ".join(name)
                if name not in figures:
                    yield self._comparison(figure, row.seed, value, None, limit, "missing", now.message or now.status)
                else:
                    yield self._judged(figure, row.seed, value, figures[name][0], limit, now)

    @cached_property
    def pairs(self) -> list[tuple[float, float]]:
        """The mean logarithm of all figures before and after, of each seed of both; none where seeds do not differ."""
        before, after = _means(self.before), _means(self.after)
        return [(before[seed], after[seed]) for seed in sorted(before.keys() & after.keys())] if self._spread else []

    def judged_on_average(self, pairs: Sequence[tuple[float, float]]) -> Comparison:
        """Compare the geometric mean of all figures of both, which spreads less than each of them.

        The same seeds give the same figures but for rounding, which a long training may blow up: how much their changes
        differ tells (Student's paired t). A loss that all seeds share has no such spread. One seed tells no spread: it
        may lose what one draw of the reference's seeds loses against another.
        """
        was, is_now = (math.exp(statistics.fmean(of)) for of in zip(*pairs, strict=True))
        changes = [after - before for before, after in pairs]
        if len(changes) > 1:
            known, of_the_mean = changes, 1 / math.sqrt(len(changes))
        else:
            known, of_the_mean = list(_means(self.before).values()), math.sqrt(2)
        reach = _once_in_a_thousand(len(known)) * statistics.stdev(known) * of_the_mean if len(known) > 1 else 0.0
        limit = was * math.exp(min(max(reach, math.log1p(STOCHASTIC)), ENDLESS))
        return self._judged(ON_AVERAGE, None, was, is_now, limit, None)

    def _allowed(self, value: float, sigma: float, seeds: int, scale: float) -> float:
        if not math.isfinite(value):
            return 0.0
        reach = _once_in_a_thousand(seeds) * math.sqrt(2) * sigma if seeds > 1 else 0.0
        if self._stochastic:
            return max(reach, STOCHASTIC * value)
        return max(reach, COMPUTED * value) + ROUNDING * scale

    def _judged(
        self, figure: str, seed: int | None, before: float, after: float, limit: float, row: Result | None
    ) -> Comparison:
        margin = limit - before if math.isfinite(before) else 0.0
        verdict: Change = "worse" if after > limit else "better" if after < before - margin else "same"
        why = row.message if row is not None and row.status != "ok" and verdict == "worse" else ""
        return self._comparison(figure, seed, before, after, limit, verdict, why)

    def _comparison(
        self, figure: str, seed: int | None, before: float | None, after: float | None, limit: float,
        verdict: Change, why: str = "",
    ) -> Comparison:  # fmt: skip
        return Comparison(self.suite, self.model, self.dataset, figure, seed, before, after, limit, verdict, why)

    @cached_property
    def _stochastic(self) -> bool:
        """What the model declares, in the reference or, where no row of it says so, in the new results."""
        rows = (*self.before, *self.after)
        return next((row.provenance["stochastic"] is True for row in rows if "stochastic" in row.provenance), False)

    @cached_property
    def _spread(self) -> dict[FigureName, tuple[float, int]]:
        """Standard deviation over the reference's seeds of each figure that differs among them, and their number."""
        values: dict[FigureName, list[float]] = {}
        for row in self.before:
            for name, (value, _) in _figures(row).items():
                if math.isfinite(value):
                    values.setdefault(name, []).append(value)
        return {
            name: (statistics.stdev(many), len(many)) for name, many in values.items()
            if len(many) > 1 and max(many) > min(many)
        }  # fmt: skip


@cache
def _once_in_a_thousand(draws: int) -> float:
    """How far a mean may lie off, in deviations that are estimated from so many draws."""
    return float(student.ppf(1 - ALARM, draws - 1))


def _figures(row: Result) -> dict[FigureName, tuple[float, float]]:
    """Every RMSE of a row with the spread of what was measured: of the whole record, and at each horizon."""
    rmse: dict[FigureName, tuple[float, float]] = {}
    for output, figures in row.metrics.items():
        scale = float(figures.get("std", 0.0))
        if "rmse" in figures:
            rmse[row.experiment, row.task, output] = float(figures["rmse"]), scale
        for horizon, value in figures.get("rmse_by_horizon", {}).items():
            rmse[row.experiment, row.task, f"{output} {horizon} ahead"] = float(value), scale
    return rmse


def _means(rows: Sequence[Result]) -> dict[int, float]:
    """Of each seed the mean logarithm of its RMSEs; a seed with one that has no logarithm is left to its rows."""
    values: dict[int, list[float]] = {}
    for row in rows:
        values.setdefault(row.seed, []).extend(value for value, _ in _figures(row).values())
    return {
        seed: statistics.fmean(map(math.log, many)) for seed, many in values.items()
        if many and all(0 < value < math.inf for value in many)
    }  # fmt: skip


def _grouped(rows: Sequence[Result]) -> dict[tuple[str, str, str], list[Result]]:
    groups: dict[tuple[str, str, str], list[Result]] = {}
    for row in rows:
        model, params, dataset, *_ = store.key(row)
        groups.setdefault((model, params, dataset), []).append(row)
    return groups


def _other_data(before: Sequence[Result], after: Sequence[Result]) -> list[str]:
    """The data sets that are not those of the reference, to the last bit."""
    theirs = {(row.dataset, row.provenance.get("data_sha256")) for row in before}
    known = {name for name, _ in theirs}
    others = {row.dataset for row in after if row.dataset in known
              and (row.dataset, row.provenance.get("data_sha256")) not in theirs}  # fmt: skip
    return [f"{name} is not the same data as in the reference, to the last bit" for name in sorted(others)]
