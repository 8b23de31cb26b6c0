"""`simgap fit`: one model on one data set, in the foreground."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from simgap.cli.options import (
    DataOrLogs,
    Inputs,
    Json,
    KindOf,
    KnownOf,
    Outputs,
    Resample,
    SamplingTime,
    SplitGaps,
    check_writable,
    model_faults,
    parse_params,
    read_data,
    refuse,
    write_json,
)

if TYPE_CHECKING:
    import rich.console
    import rich.table

    from simgap.running.fitting import Fit

# Longer lists, such as a loss per epoch, are for machines.
MANY = 8


def fit(
    model: Annotated[str, typer.Argument(help="Name of a model, or path/to/file.py:Class.")],
    data: DataOrLogs,
    inputs: Inputs = None,
    outputs: Outputs = None,
    dt: SamplingTime = None,
    kind: KindOf = None,
    resample: Resample = None,
    split_gaps: SplitGaps = False,
    known: KnownOf = None,
    param: Annotated[list[str] | None, typer.Option(help="name=value of the model; repeatable.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the fit.")] = 0,
    save: Annotated[Path | None, typer.Option(help="Write the fitted model into this file.")] = None,
    json: Json = None,
) -> None:
    """Fit one model and print what it chose and how well it simulates the test experiments."""
    from rich.console import Console

    from simgap.results import store
    from simgap.running import fitting
    from simgap.saved.archive import save_model
    from simgap.saved.codec import name_of

    params = parse_params(param or ())
    check_writable(json, save, read=[*data, model])
    if save is not None:
        name_of(fitting.model_class(model))  # refuses what no file could name
    console = Console()
    fitting.check_params(model, params)  # first, because data may take seconds to load
    if not getattr(fitting.model_class(model), "takes_known", False):
        refuse({"known": known}, f"{model} cannot be told of the machine; grey boxes can, such as greybox-auto")
    dataset = read_data(data, inputs, outputs, dt, kind, resample, split_gaps, known).dataset
    with model_faults("fit"), _progress(console):
        done = fitting.fit(model, dataset, params, seed)
    if json is not None:
        write_json(json, store.encoded(done.results))
    _print_model(console, done)
    free_runs = [result for result in done.results if result.task == "free_run"]
    console.print(score_table((result.experiment, result.metrics, result.units) for result in free_runs))
    if save is not None:
        save_model(done.model, save, dataset)
        typer.echo(f"Saved: {save}")
    if any(result.status == "error" for result in done.results):
        raise typer.Exit(1)


@contextmanager
def _progress(console: rich.console.Console) -> Iterator[None]:
    """Show a bar with the time left for models that say how far they are, on a terminal."""
    from rich.progress import Progress

    from simgap.protocol import listen

    if not console.is_terminal:
        yield
        return
    with Progress(console=console, transient=True) as bar:
        task = bar.add_task("fit", total=None)
        listen(lambda done, total: bar.update(task, completed=done, total=total))
        try:
            yield
        finally:
            listen(None)


def _short_text(value: object) -> str:
    """What a fit chose, for people."""
    if isinstance(value, dict):
        return " ".join(f"{name} {_short_text(part)}" for name, part in value.items())
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _print_model(console: rich.console.Console, done: Fit) -> None:
    first = done.results[0]
    size = "" if first.n_params is None else f", parameters: {first.n_params}"
    lines = [f"{first.model} on {first.dataset}: fitted in {first.fit_seconds:.3g} s{size}"]
    if first.fitted:
        short = {
            name: value for name, value in first.fitted.items() if not (isinstance(value, list) and len(value) > MANY)
        }
        lines.append("chosen: " + ", ".join(f"{name} = {_short_text(value)}" for name, value in short.items()))
    summary = getattr(done.model, "summary", None)
    if callable(summary):
        lines.append(str(summary()))
    lines += list(dict.fromkeys(f"note: {result.message}" for result in done.results if result.message))
    for line in lines:
        console.print(line, markup=False, highlight=False)


def score_table(free_runs: Iterable[tuple[str, dict[str, dict[str, Any]], dict[str, str]]]) -> rich.table.Table:
    """The scores of free runs per experiment and output, from the experiment's name, its figures and the units."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from simgap.reports.rendering import printable

    table = Table("experiment", "output", title="Free-run simulation", title_justify="left", box=box.SIMPLE_HEAD)
    for heading in ("RMSE", "fit %", "samples"):
        table.add_column(heading, justify="right")
    for experiment, metrics, units in free_runs:
        for output, figures in metrics.items():
            texts = (
                experiment, output, f"{figures['rmse']:.4g} {units.get(output, '')}".strip(),
                f"{figures['fit_percent']:.1f}", str(figures["n_scored"]),
            )  # fmt: skip
            table.add_row(*(Text(printable(text)) for text in texts))
    return table
