"""`simgap run hide-and-seek`: how often a diagnosis finds what was hidden."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import typer


def run(jobs: int, out: Path, seeds: int | None, rigs: list[str] | None, json: Path | None) -> None:
    """Run what is missing of the suite, then print the summary and draw the matrix."""
    from rich.console import Console
    from rich.progress import Progress

    from simgap.cli.options import check_writable, write_json
    from simgap.diagnosis.recovery import FILE, hide_and_seek
    from simgap.reports import confusion

    check_writable(json)
    console = Console()
    try:
        with Progress(console=console, transient=True) as progress:
            bar = progress.add_task("hide-and-seek")
            outcomes = hide_and_seek(
                rigs or (), seeds=seeds or 1, jobs=jobs, out=out,
                tell=lambda done, total: progress.update(bar, completed=done, total=total),
            )  # fmt: skip
    except KeyboardInterrupt:
        typer.echo("interrupted; what is done is stored, and the same command carries on", err=True)
        raise typer.Exit(130) from None
    rows = [asdict(outcome) for outcome in outcomes]
    lines = confusion.summary(rows, [outcome.right for outcome in outcomes])
    if json is not None:
        write_json(json, dict(lines))
    file = Path(out) / FILE.with_name("confusion.png")
    confusion.picture(rows, file)
    for label, text in lines:
        console.print(f"{label}: {text}", highlight=False, markup=False)
    failed = [outcome for outcome in outcomes if outcome.error]
    console.print(f"The matrix: {file}; every case: {Path(out) / FILE}", highlight=False, markup=False)
    if failed:
        console.print(f"{len(failed)} cases failed, the first: {failed[0].error}", markup=False)
        raise typer.Exit(1)
