"""`simgap report`: stored results as tables."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def report(
    folder: Annotated[Path, typer.Argument(metavar="[DIR]", help="Folder of results.")] = Path("results"),
    site: Annotated[Path | None, typer.Option(help="Folder of the site; DIR/site by default.")] = None,
    no_site: Annotated[bool, typer.Option("--no-site", help="Write no site.")] = False,
    figures: Annotated[
        bool, typer.Option("--figures", help="Write DIR/figures: pictures as SVG and PDF, tables as LaTeX.")
    ] = False,
    public: Annotated[bool, typer.Option("--public", help="Leave out signals of data sets without a licence.")] = False,
) -> None:
    """Show the stored results, and write leaderboard.md, results.csv and a site to browse them next to them."""
    from rich.console import Console

    from simgap.reports import leaderboard
    from simgap.reports.recovery import FOLDER
    from simgap.reports.rendering import to_rich
    from simgap.reports.site.site import check_free, write_site

    out = folder / "site" if site is None else site
    if not no_site:
        check_free(out)  # before anything is written
    written = leaderboard.report(folder)
    console = Console()
    for suite, tables in written.tables.items():
        console.rule("recovery study" if suite == FOLDER else suite, align="left")
        for table in tables:
            console.print(to_rich(table, console.width))
    typer.echo(f"Written: {' and '.join(str(file) for file in (written.markdown, written.csv) if file)}")
    if figures:
        from simgap.reports.figures import write_figures

        files = write_figures(folder, public=public)
        typer.echo(f"Figures and LaTeX tables: {len(files)} files in {folder / 'figures'}")
    if not no_site:
        typer.echo(f"The site: {write_site(folder, out, public)}")
