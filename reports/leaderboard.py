"""The leaderboard: stored results as one Markdown page and one CSV file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from simgap.records import Result, UnusableInput
from simgap.reports import recovery
from simgap.reports.chosen import chosen_table
from simgap.reports.collection import Collection
from simgap.reports.crossover import crossover_tables, of_crossover
from simgap.reports.error_ratios import Ratios, error_ratios
from simgap.reports.modes import modes_table
from simgap.reports.paper.claims import claims, claims_table
from simgap.reports.paper.tables import of_paper, paper_tables
from simgap.reports.published import published_markdown
from simgap.reports.rendering import escape, to_markdown
from simgap.reports.skill import skill_table
from simgap.reports.tables import Table, dataset_table, overview, tidy
from simgap.results import store

FEW = 2  # data sets, whose figures are shown after a run

HOW_TO_READ = (
    "Every model is simulated over the whole test record from its first measured outputs alone (free run). "
    "Fit is 100 (1 - RMSE / standard deviation), pooled over test experiments and outputs; the best of a "
    "column is bold. 'k ahead' is the RMSE of a forecast k samples after the last measured output it uses. "
    "Where the seeds of a model differ: median (range); those of a deterministic model show the effect of rounding."
)


@dataclass(frozen=True)
class Report:
    """The tables of each suite and of the recovery study, and the files they were written to.

    `csv` holds the rows of the models; None where there are none.
    """

    tables: dict[str, list[Table]]
    markdown: Path
    csv: Path | None


def report(folder: str | Path = "results") -> Report:
    """Write `leaderboard.md` and `results.csv` into a folder of results, or into the folder of one suite.

    Raises UnusableInput when there are no results or a file is damaged.
    """
    folder = Path(folder)
    suites = read_suites(folder)
    tables = all_tables(Collection(folder, suites))
    markdown = folder / "leaderboard.md"
    markdown.write_text(_page(tables), encoding="utf-8")
    frames = [tidy(results).assign(suite=suite) for suite, results in suites.items()]
    if not frames:
        return Report(tables, markdown, None)
    csv = folder / "results.csv"
    pd.concat(frames).to_csv(csv, index=False)
    return Report(tables, markdown, csv)


def all_tables(collection: Collection) -> dict[str, list[Table]]:
    """Make the tables of each suite and, under the name of its folder, of the recovery study."""
    suites = collection.suites
    crossover = [row for results in suites.values() if of_crossover(results) for row in results]
    tables = {
        suite: tables_of(results, crossover, {} if of_crossover(results) else error_ratios(collection, suite))
        for suite, results in suites.items()
    }
    study = recovery.tables(collection.folder)
    return tables | ({recovery.FOLDER: study} if study else {})


def tables_of(results: list[Result], crossover: Sequence[Result] = (), ratios: Ratios | None = None) -> list[Table]:
    """Make the overview and each data set's table, before them the paper's tables and claims for its suite.

    The rows of the crossover study have tables of their own, and decide some of those claims. `ratios` compare rows
    with the best one of their data set.
    """
    if of_crossover(results):
        return crossover_tables(results)
    of_all = [table for table in (chosen_table(results), skill_table(results), modes_table(results)) if table]
    return [*_of_paper(results, crossover), overview(results, ratios), *of_all, *_of_datasets(results, ratios)]


def brief(results: list[Result]) -> list[Table]:
    """Make the tables shown after a run: the figures of a few data sets in their units, of many the overview."""
    if of_crossover(results):
        return crossover_tables(results)[:1]
    details = _of_datasets(results)
    return [*_of_paper(results), *(details if len(details) <= FEW else [overview(results)])]


def _of_paper(results: list[Result], crossover: Sequence[Result] = ()) -> list[Table]:
    return [*paper_tables(results), claims_table(claims(results, crossover))] if of_paper(results) else []


def _of_datasets(results: list[Result], ratios: Ratios | None = None) -> list[Table]:
    datasets = sorted({result.dataset for result in results})
    return [dataset_table(results, dataset, (ratios or {}).get(dataset)) for dataset in datasets]


def read_suites(folder: Path) -> dict[str, list[Result]]:
    """Read the rows of all suites in a folder of results; none where it holds a recovery study only.

    Raises UnusableInput where it holds neither.
    """
    if not folder.is_dir():
        raise UnusableInput(f"there is no folder {folder}; `simgap run` makes one")
    folders = [folder, *store.suites_in(folder)]
    suites = {path.resolve().name: rows for path in folders if (rows := store.read(path))}
    if not suites and not recovery.read(folder):
        raise UnusableInput(f"{folder} holds no results; `simgap run` makes them")
    return suites


ABOUT_SUITE = {
    "smoke": "The reference of `simgap check`: a small data set, on which the networks are hardly trained. It says "
    "whether a change of the code changed a figure, not which model is good.",
}


def _page(tables: dict[str, list[Table]]) -> str:
    parts = ["# Leaderboard\n", HOW_TO_READ + "\n"]
    for suite, listed in tables.items():
        parts.append("## Recovery study\n" if suite == recovery.FOLDER else f"## Suite {escape(suite)}\n")
        parts += [f"{ABOUT_SUITE[suite]}\n"] if suite in ABOUT_SUITE else []
        parts += [to_markdown(table, level=3) for table in listed]
    return "\n".join([*parts, published_markdown()])
