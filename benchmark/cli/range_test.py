"""`simgap range-test`: which learning rate suits a network."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from simgap.cli.options import (
    Data,
    Inputs,
    Json,
    Outputs,
    Resample,
    SamplingTime,
    SplitGaps,
    check_writable,
    model_faults,
    parse_params,
    read_data,
    write_json,
)


def range_test(
    model: Annotated[str, typer.Argument(help="Name of a network.")],
    data: Data,
    inputs: Inputs = None,
    outputs: Outputs = None,
    dt: SamplingTime = None,
    resample: Resample = None,
    split_gaps: SplitGaps = False,
    param: Annotated[list[str] | None, typer.Option(help="name=value of the model; repeatable.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the weights and of the batches.")] = 0,
    json: Json = None,
    html: Annotated[Path | None, typer.Option(help="Write the curve as a page to this file.")] = None,
) -> None:
    """Raise the learning rate from batch to batch and show where the loss falls and where it explodes.

    Take a rate below the steepest fall; the paper's section 3.4 took the lowest one that still falls fast.
    """
    from simgap.records import UnusableInput
    from simgap.reports.curves import LearningRates
    from simgap.running import fitting

    check_writable(json, html, read=[data, model])
    built: Any = fitting.build(model, parse_params(param or ()))
    if not hasattr(built, "range_test"):
        raise UnusableInput(f"{model} has no learning rate; networks have: see `simgap list models`")
    dataset = read_data(data, inputs, outputs, dt, None, resample, split_gaps).dataset
    with model_faults("fit"):
        rates, losses = built.range_test(dataset.training, seed)
    curve = LearningRates(model, dataset.name, rates, losses)
    if json is not None:
        write_json(json, curve.to_json())
    if html is not None:
        html.write_text(curve.to_html(), encoding="utf-8")
    typer.echo(str(curve))
