"""`simgap run`: a suite, with progress."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from simgap.cli.options import Inputs, Json, Outputs, SamplingTime, names, write_json

if TYPE_CHECKING:
    import rich.console

    from simgap.records import Result
    from simgap.running.runner import Listener, Progress

FAILED = ("error", "timeout")


def run(
    suite: Annotated[str, typer.Argument(help="Name of a suite, or path of a .toml file.")] = "full",
    models: Annotated[str | None, typer.Option(help="Only these models: a,b.")] = None,
    model: Annotated[list[str] | None, typer.Option(help="path/to/file.py:Class; repeatable.")] = None,
    datasets: Annotated[str | None, typer.Option(help="Only these data sets, names or paths: x,y.")] = None,
    seeds: Annotated[int | None, typer.Option(help="Number of seeds.")] = None,
    jobs: Annotated[int, typer.Option(help="Number of jobs at a time on this machine.")] = 1,
    engine: Annotated[str, typer.Option(help="Where the jobs run: local or ray.")] = "local",
    address: Annotated[str | None, typer.Option(help="Address of a Ray cluster.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of the results.")] = Path("results"),
    inputs: Inputs = None,
    outputs: Outputs = None,
    dt: SamplingTime = None,
    json: Json = None,
) -> None:
    """Fit models to data sets and score their free-run simulation; a second run carries on.

    The suite hide-and-seek instead hides physical effects in simulated rigs (--datasets names them) and counts how
    often `simgap diagnose` finds them.
    """
    if suite == "hide-and-seek":
        from simgap.cli import recovery as seeking

        seeking.run(jobs, out, seeds, names(datasets), json)
        return
    from rich.console import Console

    from simgap.reports.leaderboard import brief
    from simgap.reports.rendering import to_rich
    from simgap.results import store
    from simgap.running import runner

    console = Console()
    try:
        with _shown(console) as progress:
            results = runner.run(
                suite, names(models), model or (), names(datasets), seeds, jobs, engine, address, out,
                inputs or (), outputs or (), dt, progress,
            )  # fmt: skip
    except KeyboardInterrupt:
        typer.echo("interrupted; what is done is stored, and the same command carries on", err=True)
        raise typer.Exit(130) from None
    if json is not None:
        write_json(json, store.encoded(results))
    for table in brief(results):
        console.print(to_rich(table, console.width))
    where = f"The results are in {out}; `simgap report {out}` makes the leaderboard."
    console.print(where, markup=False, highlight=False)
    if any(result.status in FAILED for result in results):
        raise typer.Exit(1)


@contextmanager
def _shown(console: rich.console.Console) -> Iterator[Listener]:
    """A bar with the time left on a terminal, a plain line per finished job elsewhere."""
    if not console.is_terminal:
        yield lambda progress: _print_line(console, progress)
        return
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.description}", markup=False),
    )
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=None)

        def show(progress: Progress) -> None:
            _print_line(console, progress)
            if progress.total:
                running = ", ".join(progress.running)
                share = max(progress.share, progress.done / progress.total)
                bar.update(task, completed=share, total=1, description=f"{progress.done}/{progress.total}  {running}")

        yield show


def _print_line(console: rich.console.Console, progress: Progress) -> None:
    if progress.note:
        console.print(progress.note, markup=False, highlight=False)
    if progress.finished:
        from simgap.reports.rendering import printable

        text = f"[{progress.done}/{progress.total}] {_summary(progress.finished)}"
        console.print(printable(text), markup=False, highlight=False, soft_wrap=True)


def _summary(results: tuple[Result, ...]) -> str:
    first = results[0]
    bad = next((row for row in results if row.status != "ok"), None)
    about = f"{first.model} on {first.dataset}, seed {first.seed}: "
    if bad is not None:
        return about + f"{bad.status}, {bad.message}"
    return about + f"fitted in {first.fit_seconds:.3g} s"
