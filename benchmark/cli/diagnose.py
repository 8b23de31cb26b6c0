"""`simgap diagnose`: what the simulation gets wrong, and why."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

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
    read_data,
    write_json,
)


def diagnose(
    data: DataOrLogs,
    inputs: Inputs = None,
    outputs: Outputs = None,
    dt: SamplingTime = None,
    kind: KindOf = None,
    resample: Resample = None,
    split_gaps: SplitGaps = False,
    known: KnownOf = None,
    simulated: Annotated[
        list[str] | None,
        typer.Option(help="Column with the output of your own simulation, which is diagnosed; one for each output."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the resampling.")] = 0,
    json: Json = None,
    html: Annotated[Path | None, typer.Option(help="Write the answer as one page with plots to this file.")] = None,
    save: Annotated[Path | None, typer.Option(help="Write the model that the answer ends with into this file.")] = None,
) -> None:
    """Show what a linear model of the data, or your own simulation, gets wrong, why, and what correcting it gains."""
    check_writable(json, html, save, read=data)
    reading = read_data(data, inputs, outputs, dt, kind, resample, split_gaps, known, simulated)

    # Here, so that a file that cannot be used is refused before loops are compiled.
    from simgap.diagnosis.diagnose import diagnose
    from simgap.saved.archive import save_model

    answer = diagnose(reading.dataset, seed=seed, profiles=html is not None, simulated=reading.simulated)
    if json is not None:
        write_json(json, answer.to_json())
    if html is not None:
        html.write_text(answer.to_html(), encoding="utf-8")
    typer.echo(str(answer))
    if save is not None:
        save_model(answer.model, save, reading.dataset)
        typer.echo(f"Saved: {save}")
