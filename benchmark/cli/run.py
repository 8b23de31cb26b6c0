"""`simgap run`: a suite, with progress."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from simgap.cli.options import (
    Inputs,
    Json,
    Outputs,
    Resample,
    SamplingTime,
    SplitGaps,
    check_writable,
    names,
    refuse,
    write_json,
)
from simgap.cli.progress import shown

if TYPE_CHECKING:
    from simgap.records import Result

FAILED = ("error", "timeout")


def run(
    suite: Annotated[str, typer.Argument(help="Name of a suite, path of a .toml file, or recovery.")] = "full",
    models: Annotated[str | None, typer.Option(help="Only these models: a,b.")] = None,
    model: Annotated[list[str] | None, typer.Option(help="path/to/file.py:Class; repeatable.")] = None,
    datasets: Annotated[str | None, typer.Option(help="Only these data sets, names or paths: x,y.")] = None,
    seeds: Annotated[int | None, typer.Option(help="Number of seeds.")] = None,
    jobs: Annotated[int, typer.Option(help="Number of jobs at a time on this machine.")] = 1,
    engine: Annotated[str, typer.Option(help="Where the jobs run: local, ray, or one of your own.")] = "local",
    address: Annotated[str | None, typer.Option(help="Address of a Ray cluster.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of the results.")] = Path("results"),
    inputs: Inputs = None,
    outputs: Outputs = None,
    dt: SamplingTime = None,
    resample: Resample = None,
    split_gaps: SplitGaps = False,
    json: Json = None,
) -> None:
    """Fit models to data sets and score their free-run simulation; a second run carries on.

    `simgap run recovery` is a study instead: it hides physical effects in simulated rigs (--datasets names those) and
    counts how often `simgap diagnose` names them.
    """
    from simgap.running.suites import STUDY

    check_writable(json, read=[suite, *(names(datasets) or ()), *(model or ())])
    if suite == STUDY:
        from simgap.cli import recovery

        given = {"models": models, "model": model, "input": inputs, "output": outputs, "dt": dt,
                 "resample": resample, "split-gaps": split_gaps}  # fmt: skip
        refuse(given, "the recovery study takes none; --datasets names its rigs")
        recovery.run(names(datasets) or [], 1 if seeds is None else seeds, engine, jobs, address, out, json)
        return
    from rich.console import Console

    from simgap.reports.leaderboard import brief
    from simgap.reports.rendering import to_rich
    from simgap.results import store
    from simgap.running import runner

    console = Console()
    with shown(console, _summary) as progress:
        results = runner.run(
            suite, names(models), model or (), names(datasets), seeds, jobs, engine, address, out,
            inputs or (), outputs or (), dt, progress, resample, split_gaps,
        )  # fmt: skip
    if json is not None:
        write_json(json, store.encoded(results))
    for table in brief(results):
        console.print(to_rich(table, console.width))
    where = f"The results are in {out}; `simgap report {out}` makes the leaderboard."
    console.print(where, markup=False, highlight=False)
    if any(result.status in FAILED for result in results):
        raise typer.Exit(1)


def _summary(results: tuple[Result, ...]) -> str:
    first = results[0]
    bad = next((row for row in results if row.status != "ok"), None)
    about = f"{first.model} on {first.dataset}, seed {first.seed}: "
    if bad is not None:
        return about + f"{bad.status}, {bad.message}"
    return about + f"fitted in {first.fit_seconds:.3g} s"
