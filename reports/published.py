"""Figures that other people published, kept apart from what was run here."""

from __future__ import annotations

import tomllib
from pathlib import Path

from simgap.reports.rendering import escape, to_markdown
from simgap.reports.tables import Cell, Table

FILE = Path(__file__).parent / "published.toml"
WARNING = (
    "Free-run RMSE as printed by others. These models were not run here, and other samples were scored: "
    "compare with care."
)


def published_tables() -> list[Table]:
    """Make one table per source, free-run RMSE as printed there; the notes say what was scored."""
    with FILE.open("rb") as file:
        sources = tomllib.load(file)["source"]
    return [
        Table(
            title=source["title"],
            columns=["model", *(" ".join(column) for column in source["columns"])],
            rows=[[Cell(model), *(Cell(f"{figure:g}") for figure in row)] for model, row in source["rmse"].items()],
            notes=[f"{source['where']}. Scored: {source['window']}."],
        )
        for source in sources
    ]


def published_markdown() -> str:
    """Write the section of a report, with a warning on top."""
    tables = [to_markdown(table, level=3) for table in published_tables()]
    return "\n".join(["## Published by others\n", escape(WARNING) + "\n", *tables])
