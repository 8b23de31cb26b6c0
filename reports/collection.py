"""What a site is made of: rows by suite, the artefacts of their fits, and the user's copies of the data sets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from simgap.data import Missing, card, load
from simgap.records import Dataset, Result, UnusableInput
from simgap.registry import DATASETS
from simgap.reports.pooling import Standing, standings
from simgap.results import artefacts
from simgap.results.artefacts import Artefact

OTHER_COPY = "Signals are not shown: the copy at hand differs from the one that these rows were scored on."
NO_LICENCE = ("not ", "none", "unknown")  # how a card begins that names no licence


@dataclass(frozen=True, eq=False)
class Run:
    """One fit of a model on one data set that left an artefact: the first seed that did."""

    suite: str
    standing: Standing
    seed: int
    artefact: Artefact


@dataclass(frozen=True, eq=False)
class DataCopy:
    """A data set as a page shows it: the user's copy, or in one sentence why there is none."""

    name: str
    dataset: Dataset | None
    why_not: str = ""

    @cached_property
    def card(self) -> list[tuple[str, str]]:
        """The card of a registered data set as headings and texts; the first heading is empty."""
        if self.name not in DATASETS:
            return []
        title, *lines = card(self.name).splitlines()
        parts: list[tuple[str, str]] = [("", title)]
        for line in filter(None, map(str.strip, lines)):
            heading, colon, rest = line.partition(":")
            if colon and heading in ("Machine", "Channels", "Samples", "Source", "Licence", "Reference"):
                parts.append((heading, rest.strip()))
            elif len(parts) == 1:
                parts.append(("About", line))
            else:
                parts[-1] = (parts[-1][0], f"{parts[-1][1]} {line}")
        return parts

    @property
    def may_be_shown(self) -> bool:
        """Whether samples may stand on a page for others: simgap made them, or their licence is stated."""
        if DATASETS.module(self.name).startswith("simgap.data.simulated"):
            return True
        licence = dict(self.card).get("Licence", "").lower()
        return bool(licence) and not licence.startswith(NO_LICENCE)


@dataclass(frozen=True, eq=False)
class Collection:
    """All that stands in a folder of results; `public` leaves out samples that others may not be shown."""

    folder: Path
    suites: dict[str, list[Result]]
    public: bool = False
    _copies: dict[str, DataCopy] = field(default_factory=dict)

    @cached_property
    def datasets(self) -> list[str]:
        """The names of all data sets with rows."""
        return sorted({row.dataset for rows in self.suites.values() for row in rows})

    @cached_property
    def standings(self) -> dict[str, list[Standing]]:
        """The models on the data sets, by suite."""
        return {suite: standings(rows) for suite, rows in self.suites.items()}

    @cached_property
    def models(self) -> list[str]:
        """The labels of all models with rows."""
        return sorted({s.model for found in self.standings.values() for s in found}, key=str.lower)

    @cached_property
    def runs(self) -> dict[tuple[str, str, str], Run]:
        """The fits that left an artefact of the same code and data as their rows, by suite, model and data set."""
        found = {}
        for suite, listed in self.standings.items():
            for standing in listed:
                if run := self._run(suite, standing):
                    found[suite, standing.model, standing.dataset] = run
        return found

    def _run(self, suite: str, standing: Standing) -> Run | None:
        seed, artefact = next(iter(self.artefacts_of(suite, standing).items()), (0, None))
        return Run(suite, standing, seed, artefact) if artefact else None

    def artefacts_of(self, suite: str, standing: Standing) -> dict[int, Artefact]:
        """Read the artefacts of the same code and data as their rows, by seed."""
        first = {row.seed: row for row in reversed(standing.rows)}
        found = {}
        for seed in sorted(first):
            path = artefacts.path_of(self._home(suite), suite, first[seed])
            artefact = artefacts.read(path) if path.is_file() else None
            if artefact is not None and artefact.belongs_to(first[seed]):
                found[seed] = artefact
        return found

    def _home(self, suite: str) -> Path:
        """The folder of results; one above where only the folder of one suite is reported."""
        whole = self.folder.resolve()
        return whole.parent if whole.name == suite and not (whole / suite).is_dir() else whole

    def copy_of(self, name: str) -> DataCopy:
        """Find the user's copy of a data set, the one that the rows were scored on."""
        if name not in self._copies:
            self._copies[name] = self._found(name)
        return self._copies[name]

    def copy_behind(self, run: Run) -> DataCopy:
        """Find the user's copy of the data that a fit was scored on."""
        copy = self.copy_of(run.standing.dataset)
        if copy.dataset is not None and copy.dataset.sha256 != run.artefact.data_sha256:
            return DataCopy(copy.name, None, OTHER_COPY)
        return copy

    def _found(self, name: str) -> DataCopy:
        rows = [row for listed in self.suites.values() for row in listed if row.dataset == name]
        wanted = {str(row.provenance.get("data_sha256", "")) for row in rows}
        sources = [run.artefact.source for run in self.runs.values() if run.standing.dataset == name]
        copies = [lambda: load(name)] if name in DATASETS else []
        copies += [
            lambda source=source: load(**source) for source in _different(sources) if source.get("source") != name
        ]
        why = "Its files are not known here, so its signals are not shown."
        for load_copy in copies:
            try:
                dataset = load_copy()
            except Missing as error:
                why = f"Signals are not shown: {error}."
            except (UnusableInput, OSError, TypeError) as error:
                why = f"Signals are not shown: {error}"
            else:
                if dataset.sha256 in wanted:
                    return self._allowed(DataCopy(name, dataset))
                why = OTHER_COPY
        return DataCopy(name, None, why)

    def _allowed(self, copy: DataCopy) -> DataCopy:
        if self.public and not copy.may_be_shown:
            return DataCopy(copy.name, None, "Signals are left out of this public page: the data set has no licence.")
        return copy


def _different(sources: Sequence[dict]) -> list[dict]:
    return list({repr(source): source for source in sources}.values())


def group_of(standings_of_model: Sequence[Standing]) -> str:
    """Tell what kind of model it is from what its fits chose."""
    rows = [row for standing in standings_of_model for row in standing.rows]
    if any("effects" in row.fitted for row in rows):
        return "physical causes"
    if any("train_loss" in row.fitted for row in rows):
        return "networks on windows" if rows[0].model.endswith(" windowed") else "networks"
    if any(row.provenance.get("stochastic") for row in rows):
        return "networks"
    return "classical"
