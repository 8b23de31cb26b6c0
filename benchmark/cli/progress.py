"""How far a run is, on the terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    import rich.console

    from simgap.running.execution import Listener, Progress

# What is printed of the rows of a job that has ended.
Summary = Callable[[tuple[Any, ...]], str]


@contextmanager
def shown(console: rich.console.Console, summary: Summary) -> Iterator[Listener]:
    """A bar with the time left on a terminal, a plain line per finished job elsewhere.

    Ctrl-C ends the command with exit code 130 and a sentence.
    """
    try:
        if console.is_terminal:
            with _bar(console, summary) as listener:
                yield listener
        else:
            yield lambda progress: _print_line(console, progress, summary)
    except KeyboardInterrupt:
        typer.echo("interrupted; what is done is stored, and the same command carries on", err=True)
        raise typer.Exit(130) from None


@contextmanager
def _bar(console: rich.console.Console, summary: Summary) -> Iterator[Listener]:
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
            _print_line(console, progress, summary)
            if progress.total:
                running = ", ".join(progress.running)
                share = max(progress.share, progress.done / progress.total)
                bar.update(task, completed=share, total=1, description=f"{progress.done}/{progress.total}  {running}")

        yield show


def _print_line(console: rich.console.Console, progress: Progress, summary: Summary) -> None:
    if progress.note:
        console.print(progress.note, markup=False, highlight=False)
    if progress.finished:
        from simgap.reports.rendering import printable

        text = f"[{progress.done}/{progress.total}] {summary(progress.finished)}"
        console.print(printable(text), markup=False, highlight=False, soft_wrap=True)
