"""`simgap run recovery`: how often a diagnosis names what was hidden. `simgap recovery`: how often any tool does."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from simgap.cli.options import Json, check_writable, write_json
from simgap.records import UnusableInput

if TYPE_CHECKING:
    from simgap.diagnosis.cases import CaseResult

app = typer.Typer(help="Hide effects by a secret seed, let any tool name them, count.", rich_markup_mode=None)


def run(rigs: list[str], seeds: int, engine: str, jobs: int, address: str | None, out: Path, json: Path | None) -> None:
    """Run the cases that are not stored, then print the summary and draw the matrix."""
    from rich.console import Console

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
        console.print(f"Cases that failed: {len(failed)}, the first: {failed[0].message}", markup=False)
        raise typer.Exit(1)


def _summary(results: tuple[CaseResult, ...]) -> str:
    (result,) = results
    if result.status != "ok":
        return f"{result.case}: {result.status}, {result.message}"
    return f"{result.case}: {', '.join(result.named) or result.verdict.replace('_', ' ')}"


@app.command()
def make(
    seed: Annotated[str, typer.Option(help="A text that nobody can guess; it is not written anywhere.")],
    out: Annotated[Path, typer.Option(help="Folder to write.")] = Path("cases"),
    cases: Annotated[int, typer.Option(help="Number of cases.")] = 100,
) -> None:
    """Write cases as data sets, without what is hidden in them."""
    from simgap.recovery import make_cases

    made = make_cases(seed, cases, out)
    typer.echo(f"Cases in {out}: {len(made)}. Only the seed tells what is hidden in them.")


@app.command(short_help="Let a tool name what is hidden.")
def answer(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of cases.")],
    out: Annotated[Path, typer.Option(help="File of the answers; what it holds already is kept.")] = Path(
        "answers.json"
    ),
    tool: Annotated[str, typer.Option(help="Adapter: simgap, sindy, frols or odd_even.")] = "simgap",
    jobs: Annotated[int, typer.Option(help="Number of jobs at a time on this machine.")] = 1,
    engine: Annotated[str, typer.Option(help="Where the jobs run: local, ray, or one of your own.")] = "local",
    address: Annotated[str | None, typer.Option(help="Address of a Ray cluster.")] = None,
) -> None:
    """Let a tool name what is hidden; what has failed is asked again by a second call."""
    from rich.console import Console

    from simgap import recovery
    from simgap.cli.progress import shown
    from simgap.running.execution import Execution

    with shown(Console(), _said) as listener:
        execution = Execution(engine, jobs, {"address": address}, listener=listener)
        answers = recovery.answer(folder, out, tool, execution).answers
    failed = sum(bool(said.failed) for said in answers.values())
    typer.echo(f"{len(answers)} answers of {tool} are in {out}; {failed} say that it failed")
    if failed:
        raise typer.Exit(1)


@app.command(short_help="Count right and invented names.")
def score(
    files: Annotated[list[Path], typer.Argument(metavar="ANSWERS.json ..", help="Files of answers, one per tool.")],
    seed: Annotated[str, typer.Option(help="The seed that the cases were made with.")],
    json: Json = None,
) -> None:
    """Count right and invented names; a report shows what --json writes as DIR/recovery/rates.json."""
    from rich.console import Console

    from simgap import recovery
    from simgap.reports.recovery_rates import rate_tables
    from simgap.reports.rendering import to_rich

    check_writable(json, read=[str(file) for file in files])
    counted = recovery.score(files, seed)
    if json is not None:
        write_json(json, counted)
    console = Console()
    for table in rate_tables(counted):
        console.print(to_rich(table, console.width))


def _said(rows: tuple[Any, ...]) -> str:
    ((name, said),) = rows
    names = [one if isinstance(one, str) else " or ".join(one) for one in said.names]
    return f"{name}: {said.failed or ', '.join(names) or 'nothing'} ({said.seconds:.1f} s)"
