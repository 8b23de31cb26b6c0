"""`simgap next`: what the records leave undecided, and the record that would decide it."""

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
    parse_limits,
    read_data,
    write_json,
)


def next_record(
    data: DataOrLogs,
    inputs: Inputs = None,
    outputs: Outputs = None,
    dt: SamplingTime = None,
    kind: KindOf = None,
    resample: Resample = None,
    split_gaps: SplitGaps = False,
    known: KnownOf = None,
    input_range: Annotated[
        list[str] | None,
        typer.Option(help="Range of an input: LOW,HIGH, or NAME=LOW,HIGH where there are several; repeatable."),
    ] = None,
    rate: Annotated[
        list[str] | None,
        typer.Option(help="Largest rate of an input, in its unit per second: RATE or NAME=RATE; repeatable."),
    ] = None,
    seconds: Annotated[float | None, typer.Option(help="Length of the record.")] = None,
    travel: Annotated[
        list[str] | None, typer.Option(help="Range of an output: LOW,HIGH or NAME=LOW,HIGH; repeatable.")
    ] = None,
    among: Annotated[
        Path | None,
        typer.Option(help="Choose among records that could be taken: a file, or a folder of files, with the inputs."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the signals that are tried.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Write time and inputs of the record into this CSV file.")] = None,
    json: Json = None,
) -> None:
    """Name the models that the records do not tell apart, and design the record that would; limits are as recorded.

    With --among nothing is designed: records that could be taken are ranked by how well all of them could be simulated
    afterwards.
    """
    from simgap.records import UnusableInput

    check_writable(out, json, read=data)
    if among is not None and any((input_range, rate, seconds, travel, out)):
        raise UnusableInput("--among takes the records as they are; leave out limits and --out")
    spans = [parse_limits(name, given or (), 2) for name, given in (("input-range", input_range), ("travel", travel))]
    rates = parse_limits("rate", rate or (), 1)
    dataset = read_data(data, inputs, outputs, dt, kind, resample, split_gaps, known).dataset

    # Here, so that a file that cannot be used is refused before loops are compiled.
    from simgap.experiment_design.choice import Choice, choose_record
    from simgap.experiment_design.next_record import NextRecord, next_record
    from simgap.reports.rendering import printable

    answer: Choice | NextRecord
    if among is not None:
        answer = choose_record(dataset, among)
    else:
        answer = next_record(dataset, seed=seed, input_range=spans[0], rate=rates, seconds=seconds, travel=spans[1])
    for line in str(answer).rstrip().splitlines():
        typer.echo(printable(line))
    if json is not None:
        write_json(json, answer.to_json())
    if out is not None and isinstance(answer, NextRecord) and answer.helps:
        answer.write(out)
        typer.echo(f"\nWritten: {out}")
