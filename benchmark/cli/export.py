"""`simgap export`: a fitted model for another simulator, with a record that it must repeat."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from simgap.cli.options import (
    Inputs,
    KindOf,
    KnownOf,
    Outputs,
    Resample,
    SamplingTime,
    SplitGaps,
    model_faults,
    parse_params,
    read_data,
    refuse,
)
from simgap.records import UnusableInput

# Those of simgap.exports, which help should not wait for.
FORMATS = ("c", "control", "fmu", "gymnasium", "mjcf", "onnx", "python", "urdf")


def export(
    model: Annotated[str | None, typer.Argument(help="A saved model, or the name of one that is fitted first.")] = None,
    data: Annotated[str | None, typer.Argument(help="Name of a data set, a folder or a CSV file.")] = None,
    to: Annotated[str | None, typer.Option(help=f"The format: {', '.join(FORMATS)}.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write into this new folder.")] = None,
    check: Annotated[Path | None, typer.Option("--verify", help="Run the export in this folder once more.")] = None,
    experiment: Annotated[str | None, typer.Option(help="The experiment that becomes the record.")] = None,
    known: KnownOf = None,
    into: Annotated[
        Path | None, typer.Option(help="For mjcf: write a copy of this file with the joint in it too.")
    ] = None,
    joint: Annotated[str, typer.Option(help="With --into: the name of the joint in that file.")] = "",
    inputs: Inputs = None,
    outputs: Outputs = None,
    dt: SamplingTime = None,
    kind: KindOf = None,
    resample: Resample = None,
    split_gaps: SplitGaps = False,
    param: Annotated[list[str] | None, typer.Option(help="name=value of the model; repeatable.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the fit.")] = 0,
) -> None:
    """Write a model as another simulator reads it, run it there, and say how far it is from our free run."""
    from simgap.data.formats.plant_table import parse_known
    from simgap.exports import export as exports
    from simgap.reports.rendering import printable

    if check is not None:
        if model or data or to or out:
            raise UnusableInput("--verify DIR takes an export that is there; leave out MODEL, DATA, --to and --out")
        done = exports.verify(check)
    else:
        if model is None or data is None or to is None or out is None:
            formats = ", ".join(exports.FORMATS)
            raise UnusableInput(
                f"export needs MODEL DATA --to FORMAT --out DIR, FORMAT one of {formats}; or --verify DIR"
            )
        table = parse_known(known or ())
        exports.check_target(to, out, into)  # first, because a fit takes its time
        params: dict[str, Any] = {}
        records: Any = data
        if exports.is_saved(model):
            given = {"input": inputs, "output": outputs, "kind": kind, "param": param, "seed": seed}
            refuse(given, f"{model} is a saved model, which is not fitted again; leave it out")
        else:
            exports.check_model(model, to)
            records = read_data(data, inputs, outputs, dt, kind, resample, split_gaps).dataset
            params = parse_params(param or ())
        with model_faults("export"):
            done = exports.export(
                model, records, to, out, params, seed, experiment, dt, table, into, joint, resample, split_gaps
            )
    typer.echo(printable(str(done)))
    if not done.passed:
        raise typer.Exit(1)
    if check is None:
        typer.echo(f"Written: {out}")
