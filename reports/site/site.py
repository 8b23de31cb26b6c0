"""`simgap.write_site`: a folder of results as pages."""

from __future__ import annotations

import shutil
import tempfile
from operator import attrgetter
from pathlib import Path

from simgap.data import describe
from simgap.records import UnusableInput
from simgap.registry import MODELS
from simgap.reports import recovery
from simgap.reports.chosen import chosen_table
from simgap.reports.collection import Collection, Run, group_of
from simgap.reports.crossover import crossover_tables, of_crossover
from simgap.reports.error_ratios import error_ratios
from simgap.reports.leaderboard import ABOUT_SUITE, HOW_TO_READ, read_suites
from simgap.reports.modes import WINDOWED, modes_table
from simgap.reports.paper.claims import claims, claims_table
from simgap.reports.paper.tables import NAMES, of_paper, paper_tables
from simgap.reports.pooling import Standing
from simgap.reports.published import WARNING, published_tables
from simgap.reports.site import diagnoses, runs, signals
from simgap.reports.site.crossover_charts import crossover_charts
from simgap.reports.site.diagnoses import MARK
from simgap.reports.site.fit_charts import horizon_charts, training_chart
from simgap.reports.site.model_table import model_table
from simgap.reports.site.names import file_names, script
from simgap.reports.site.pages import Writer, unique
from simgap.reports.skill import skill_table
from simgap.reports.tables import dataset_table, overview

NO_RUNS = (
    "Simulated outputs are not at hand: simgap run keeps them beside the results, in a folder that is not committed. "
    "The curves below come from the rows."
)


def write_site(folder: str | Path = "results", out: str | Path | None = None, public: bool = False) -> Path:
    """Write a folder of results as a site and return its first page; `out` is `<folder>/site` by default.

    The pages open from disk and load nothing from a network. Measured signals are read from the user's copy of each
    data set; `public` leaves out the samples of sets without a licence. A site that stands there is replaced, all or
    nothing. Raises UnusableInput when there are no results or `out` holds anything else.
    """
    folder = Path(folder)
    out = folder / "site" if out is None else Path(out)
    collection = Collection(folder, read_suites(folder), public)
    check_free(out)
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=out.parent, prefix=".site-") as new:
        site = Path(new) / "site"
        site.mkdir()
        (site / MARK).write_text("simgap report writes this folder anew each time.\n", encoding="utf-8")
        if not public:  # it may hold samples of data sets that others may not be given
            (site / ".gitignore").write_text("*\n", encoding="utf-8")
        _Site(collection, site, diagnoses.find(folder)).write()
        if out.exists():
            out.rename(Path(new) / "old")
        shutil.move(site, out)
    return out / "index.html"


def check_free(out: Path) -> None:
    """Raises UnusableInput for a folder that holds anything but a site."""
    if out.exists() and not out.is_dir():
        raise UnusableInput(f"--site {out}: there is a file of that name; name a folder")
    if out.is_dir() and any(out.iterdir()) and not (out / MARK).exists():
        raise UnusableInput(f"--site {out}: the folder holds other files, which would be lost; name a new folder")


class _Site:
    """All pages of one collection."""

    def __init__(self, collection: Collection, folder: Path, found: list[diagnoses.Found]) -> None:
        self.collection = collection
        self.found = found
        self.cases = recovery.read(collection.folder)
        self.paper = [rows for rows in collection.suites.values() if of_paper(rows)]
        self.crossover = {name: rows for name, rows in collection.suites.items() if of_crossover(rows)}
        self.dataset_keys = file_names(collection.datasets)
        self.model_keys = file_names(collection.models)
        self.suite_keys = file_names(collection.suites)
        self.groups = {
            model: group_of([s for found in collection.standings.values() for s in found if s.model == model])
            for model in collection.models
        }
        self.ratios = {name: error_ratios(collection, name) for name in collection.suites if name not in self.crossover}
        self.writer = Writer(folder, self._menu())

    def _menu(self) -> list[tuple[str, str]]:
        menu = [("index.html", "Leaderboard")]
        menu += [("datasets.html", "Data sets"), ("models.html", "Models")] if self.collection.suites else []
        menu += [("paper.html", "The paper")] if self.paper else []
        menu += [("crossover.html", "Who wins when")] if self.crossover else []
        menu += [("recovery.html", "Recovery study")] if self.cases else []
        menu += [("diagnoses.html", "Diagnoses")] if self.found else []
        return [*menu, ("published.html", "Published by others")]

    def write(self) -> None:
        """Write all pages and what they load."""
        self.writer.assets()
        self._index()
        for name in self.collection.datasets:
            self._dataset(name)
        for label in self.collection.models:
            self._model(label)
        if self.collection.suites:
            self._lists()
        self._others()

    def _links(self, root: str) -> tuple[dict[str, str], dict[str, str]]:
        models = {label: f"{root}models/{key}.html" for label, key in self.model_keys.items()}
        return models, {name: f"{root}datasets/{key}.html" for name, key in self.dataset_keys.items()}

    def _index(self) -> None:
        models, datasets = self._links("")
        suites = []
        for name, rows in self.collection.suites.items():
            if name in self.crossover and len(self.collection.suites) > 1:
                continue  # has a page of its own
            table = overview(rows, self.ratios.get(name))
            shown = [row[0].text for row in table.rows]
            suites.append({
                "name": name, "about": ABOUT_SUITE.get(name, ""), "overview": table, "chosen": chosen_table(rows),
                "skill": skill_table(rows), "modes": modes_table(rows),
                "groups": self.groups, "group_names": sorted(unique(self.groups[label] for label in shown)),
                "paper": of_paper(rows),
            })  # fmt: skip
        self.writer.page(
            "index.html", "index.html", suites=suites, how_to_read=HOW_TO_READ if suites else "",
            model_links=models, dataset_links=datasets,
        )  # fmt: skip

    def _dataset(self, name: str) -> None:
        key = self.dataset_keys[name]
        copy = self.collection.copy_of(name)
        here = [
            run for (_, _, dataset), run in self.collection.runs.items()
            if dataset == name and self.collection.copy_behind(run).dataset is not None
        ]  # fmt: skip
        if copy.dataset is not None:
            self._script(f"signals/{key}", signals.measured(copy.dataset))
            self._script(f"spectra/{key}", {"charts": signals.spectra(copy.dataset)})
        several = len({run.suite for run in here}) > 1
        listed = [
            {"key": self._key(run), "label": f"{run.standing.model} ({run.suite})" if several else run.standing.model}
            for run in sorted(here, key=attrgetter("standing.median_fit"), reverse=True)
        ]
        models, _ = self._links("../")
        tables = [
            (suite, dataset_table(rows, name, self.ratios.get(suite, {}).get(name)), self.groups)
            for suite, rows in self.collection.suites.items() if any(row.dataset == name for row in rows)
        ]  # fmt: skip
        self.writer.page(
            "dataset.html", f"datasets/{key}.html", copy=copy, key=key, tables=tables, runs=listed,
            facts=describe(copy.dataset) if copy.dataset else None, model_links=models, how_to_read=HOW_TO_READ,
        )  # fmt: skip

    def _model(self, label: str) -> None:
        suites = []
        for suite, listed in self.collection.standings.items():
            mine = [standing for standing in listed if standing.model == label]
            if not mine:
                continue
            params = mine[0].rows[0].params
            parts = [
                part for standing in sorted(mine, key=lambda s: s.dataset) if (part := self._part(suite, standing))
            ]
            suites.append({
                "name": suite, "table": model_table(mine, f"{label} on all data sets"), "parts": parts,
                "params": ", ".join(f"{name} = {value}" for name, value in sorted(params.items())),
                "no_runs": "" if any((suite, label, s.dataset) in self.collection.runs for s in mine) else NO_RUNS,
            })  # fmt: skip
        _, datasets = self._links("../")
        self.writer.page(
            "model.html", f"models/{self.model_keys[label]}.html", label=label, what=_what(label), suites=suites,
            group=self.groups[label], dataset_links=datasets,
        )  # fmt: skip

    def _part(self, suite: str, standing: Standing) -> dict | None:
        """Write what is drawn of one model on one data set; None where there is nothing to draw."""
        run = self.collection.runs.get((suite, standing.model, standing.dataset))
        copy = self.collection.copy_behind(run) if run else None
        charts = horizon_charts(standing)
        losses = training_chart(standing)
        charts += [losses] if losses else []
        content = {}
        if run is not None and copy is not None:
            charts += runs.charts(run, copy.dataset)
            content = runs.simulated(run, copy.dataset) if copy.dataset else {}
        if not charts and not content:
            return None
        key = self._key_of(suite, standing)
        self._script(key, {"charts": charts, **content})
        fit = standing.fit_percent()
        return {
            "dataset": standing.dataset, "key": key, "fit": f"{fit.median:.1f}" if fit else "",
            "signals": f"signals/{self.dataset_keys[standing.dataset]}" if content else "",
            "seed": run.seed if run else None, "why_not": copy.why_not if copy else "",
        }  # fmt: skip

    def _lists(self) -> None:
        datasets = [
            (name, f"datasets/{key}.html", (self.collection.copy_of(name).card or [("", "")])[0][1])
            for name, key in self.dataset_keys.items()
        ]
        groups = [
            (group, [(m, f"models/{self.model_keys[m]}.html", _what(m)) for m, g in self.groups.items() if g == group])
            for group in sorted(unique(self.groups.values()))
        ]
        self.writer.page("list.html", "datasets.html", heading="Data sets", groups=[("All data sets", datasets)])
        self.writer.page("list.html", "models.html", heading="Models", groups=groups)

    def _others(self) -> None:
        self.writer.page(
            "tables.html", "published.html", heading="Published by others", about=WARNING, tables=published_tables()
        )
        if self.paper:
            conditions = [row for rows in self.crossover.values() for row in rows]
            tables = [
                table for rows in self.paper for table in (*paper_tables(rows), claims_table(claims(rows, conditions)))
            ]
            about = "Tables 1 to 4 and the claims of the paper, its figures beside those of the suite paper."
            self.writer.page("tables.html", "paper.html", heading="The paper", about=about, tables=tables)
        if self.crossover:
            suites = []
            for name, rows in self.crossover.items():
                key = f"crossover/{self.suite_keys[name]}"
                self._script(key, {"charts": crossover_charts(rows)})
                suites.append({"name": name, "key": key, "tables": crossover_tables(rows)})
            self.writer.page("crossover.html", "crossover.html", suites=suites)
        if self.cases:
            self.writer.page("recovery.html", "recovery.html", **self.cases)
        diagnoses_pages(self.writer, self.found)

    def _script(self, key: str, content: dict) -> None:
        self.writer.text(f"data/{key}.js", script("simgap.have", f"{key}.js", content))

    def _key(self, run: Run) -> str:
        return self._key_of(run.suite, run.standing)

    def _key_of(self, suite: str, standing: Standing) -> str:
        model, dataset = self.model_keys[standing.model], self.dataset_keys[standing.dataset]
        return f"runs/{self.suite_keys[suite]}/{dataset}/{model}"


def diagnoses_pages(writer: Writer, found: list[diagnoses.Found]) -> None:
    """Write the pages of all diagnoses and their list; pages with plots share their copy of plotly.js."""
    keys = file_names(one.name for one in found)
    for one in found:
        file = f"diagnoses/{keys[one.name]}.html"
        if one.page:
            page, name, plotly = diagnoses.share_plotly(one.page)
            writer.text(file, page)
            if name not in ("", "plotly.js"):
                writer.text(f"assets/{name}", plotly)
        else:
            writer.page("diagnosis.html", file, found=one)
    if found:
        listed = [(one, f"diagnoses/{keys[one.name]}.html") for one in found]
        writer.page("diagnoses.html", "diagnoses.html", found=listed)


def _what(label: str) -> str:
    """Say what a model is: the first line of its own description, or its name in the paper."""
    name = label.removesuffix(WINDOWED)
    if name in MODELS:
        return MODELS.title(name).replace("`", "") + (" Here it sees windows of inputs only." if name != label else "")
    return f"In the paper: {NAMES[label]}." if label in NAMES else "A model with a label of its own."
