"""`simgap export`: a fitted model for another simulator, with a record that it must repeat."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from simgap.cli.options import (
    Inputs,
    KindOf,
    Outputs,
    Resample,
    SamplingTime,
    SplitGaps,
    parse_params,
    read_data,
)
from simgap.records import UnusableInput


def _known(pairs: Sequence[str]) -> dict[str, float]:
    """["inertia=0.1"] as {"inertia": 0.1}. Raises UnusableInput."""
    known = parse_params(pairs)
    for name, value in known.items():
        if (
            name not in ("inertia", "torque_constant")
            or type(value) not in (int, float)
            or not 0 < value < float("inf")
        ):
            raise UnusableInput(f"--plant {name}={value}: give inertia or torque_constant, a positive number")
    return known


def export(
    model: Annotated[str | None, typer.Argument(help="A saved model, or the name of one that is fitted first.")] = None,
    data: Annotated[str | None, typer.Argument(help="Name of a data set, a folder or a CSV file.")] = None,
    to: Annotated[str | None, typer.Option(help="The format, such as c or fmu.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write into this new folder.")] = None,
    check: Annotated[Path | None, typer.Option("--verify", help="Run the export in this folder once more.")] = None,
    experiment: Annotated[str | None, typer.Option(help="The experiment that becomes the record.")] = None,
    plant: Annotated[
        list[str] | None, typer.Option(help="inertia=VALUE or torque_constant=VALUE, for mjcf and urdf; repeatable.")
    ] = None,
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
    seed: Annotated[int, typer.Option(help="Seed of the fit.")] = 0,
) -> None:
    """Write a model as another simulator reads it, run it there, and say how far it is from our free run."""
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
        known = _known(plant or ())
        exports.check_target(to, out, into)  # first, because a fit takes its time
        params: dict[str, Any] = {}
        records: Any = data
        if not exports.is_saved(model):
            exports.check_model(model, to)
            records = read_data(data, inputs, outputs, dt, kind, resample, split_gaps).dataset
            params = parse_params(param or ())
        done = exports.export(model, records, to, out, params, seed, experiment, dt, known, into, joint)
    typer.echo(printable(str(done)))
    if not done.passed:
        raise typer.Exit(1)
    if check is None:
        typer.echo(f"Written: {out}")
