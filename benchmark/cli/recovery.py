"""`simgap run recovery`: how often a diagnosis names what was hidden in a simulated rig."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from simgap.records import UnusableInput

if TYPE_CHECKING:
    from simgap.diagnosis.cases import CaseResult


def run(rigs: list[str], seeds: int, engine: str, jobs: int, address: str | None, out: Path, json: Path | None) -> None:
    """Run the cases that are not stored, then print the summary and draw the matrix."""
    from rich.console import Console

    from simgap.cli.options import check_writable, write_json
    from simgap.cli.progress import shown
    from simgap.diagnosis.recovery import FILE, Grid, recovery
    from simgap.reports import confusion
    from simgap.running.execution import Execution

    check_writable(json)
    if seeds < 1:
        raise UnusableInput(f"--seeds {seeds}: give at least one seed")
    console = Console()
    with shown(console, _summary) as listener:
        results = recovery(Grid(tuple(rigs), seeds=seeds), Execution(engine, jobs, {"address": address}, out, listener))
    rows = [asdict(result) for result in results]
    figures = confusion.summary(rows, [result.right for result in results])
    for wanted in filter(None, (json, out / FILE.with_name("summary.json"))):
        write_json(wanted, dict(figures))
    file = out / FILE.with_name("confusion.png")
    confusion.picture(rows, file)
    for label, text in figures:
        console.print(f"{label}: {text}", highlight=False, markup=False)
    console.print(f"The matrix: {file}; every case: {out / FILE}", highlight=False, markup=False)
    failed = [result for result in results if result.status != "ok"]
    if failed:
        console.print(f"{len(failed)} cases failed, the first: {failed[0].message}", markup=False)
        raise typer.Exit(1)


def _summary(results: tuple[CaseResult, ...]) -> str:
    (result,) = results
    if result.status != "ok":
        return f"{result.case}: {result.status}, {result.message}"
    return f"{result.case}: {', '.join(result.named) or result.verdict.replace('_', ' ')}"
