"""`simgap check`: whether results became worse than a reference."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from simgap.cli.options import Json, check_writable, write_json
from simgap.results.store import plain


def check(
    new: Annotated[Path, typer.Argument(metavar="NEW", help="Folder of results to check.")],
    reference: Annotated[Path, typer.Option(help="Folder of results to compare with.")] = Path("reports/results"),
    markdown: Annotated[Path | None, typer.Option(help="Write the table into this file too.")] = None,
    json: Json = None,
) -> None:
    """Compare results with a reference and print a Markdown table; exit code 1 if a figure is worse or missing."""
    from simgap.reports.regressions import to_text
    from simgap.results import regression

    check_writable(markdown, json)
    found = regression.check(new, reference)
    text = to_text(found)
    typer.echo(text)
    if markdown is not None:
        markdown.write_text(text, encoding="utf-8")
    if json is not None:
        about = {"schema": 1, "passed": not found.wrong, "notes": found.notes}
        write_json(json, plain(about | {"comparisons": [asdict(one) for one in found.comparisons]}))
    if found.wrong:
        raise typer.Exit(1)
