"""`simgap report`: stored results as tables."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def report(
    folder: Annotated[Path, typer.Argument(metavar="[DIR]", help="Folder of results.")] = Path("results"),
) -> None:
    """Show the stored results and write leaderboard.md and results.csv next to them."""
    from rich.console import Console

    from simgap.reports import leaderboard
    from simgap.reports.rendering import to_rich

    written = leaderboard.report(folder)
    console = Console()
    for suite, tables in written.tables.items():
        console.rule(suite, align="left")
        for table in tables:
            console.print(to_rich(table, console.width))
    console.print(f"Written: {written.markdown} and {written.csv}", markup=False, highlight=False)
