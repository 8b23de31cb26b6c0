"""`simgap list`: what there is."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from simgap.cli.options import Json, write_json


class Kind(StrEnum):
    """What can be listed."""

    models = "models"
    datasets = "datasets"
    effects = "effects"
    suites = "suites"


def show(kind: Annotated[Kind, typer.Argument(help="What to list.")], json: Json = None) -> None:
    """List the models, data sets, effects or suites by name, with the reason where one cannot be used."""
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    entries = {Kind.models: _models, Kind.datasets: _datasets, Kind.effects: _effects, Kind.suites: _suites}[kind]()
    if json is not None:
        write_json(json, entries)
    table = Table("name", "what it is", box=box.SIMPLE_HEAD)
    for entry in entries:
        missing = bool(entry["missing"])
        table.add_row(
            Text(entry["name"], style="dim" if missing else "bold"),
            Text(entry["missing"] or entry["title"], style="dim" if missing else ""),
        )
    Console().print(table)


def _models() -> list[dict[str, str]]:
    from simgap.registry import MODELS

    entries = []
    for name in MODELS:
        missing = MODELS.why_missing(name)
        entries.append({"name": name, "title": "" if missing else MODELS.title(name), "missing": missing})
    return entries


def _datasets() -> list[dict[str, str]]:
    from simgap.data import available
    from simgap.registry import DATASETS

    return [
        {"name": name, "title": "" if missing else DATASETS.title(name), "missing": missing}
        for name, missing in available().items()
    ]


def _effects() -> list[dict[str, str]]:
    from simgap.registry import EFFECTS

    effects = [EFFECTS[name] for name in EFFECTS]
    return [
        {"name": e.name, "port": e.port, "title": e.title, "explanation": e.explanation, "reference": e.reference,
         "missing": ""}
        for e in sorted(effects, key=lambda e: (("input", "force", "output").index(e.port), e.name))
    ]  # fmt: skip


def _suites() -> list[dict[str, str]]:
    from simgap.running.suites import STUDY, STUDY_TITLE, load_suite, suite_names

    titles = {name: load_suite(name).title for name in suite_names()} | {STUDY: STUDY_TITLE}
    return [{"name": name, "title": title, "missing": ""} for name, title in titles.items()]
