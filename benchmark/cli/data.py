"""`simgap data`: make, fetch and check data sets."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from simgap.cli.options import (
    Data,
    Inputs,
    Json,
    KindOf,
    Outputs,
    Resample,
    SamplingTime,
    SplitGaps,
    check_writable,
    read_data,
    write_json,
)

app = typer.Typer(help="Make, fetch and check data sets.", rich_markup_mode=None)

Name = Annotated[str, typer.Argument(help="Name of a registered data set.")]


@app.command(short_help="Write a registered data set as a folder.")
def make(
    name: Name,
    out: Annotated[Path | None, typer.Option(help="Folder to write; the data set's name by default.")] = None,
) -> None:
    """Write a registered data set as a folder of CSV files with its dataset.toml."""
    from simgap.data import load, save

    folder = out or Path(name)
    save(load(name), folder)
    typer.echo(f"{name} is in {folder}")


@app.command()
def fetch(name: Name) -> None:
    """Download a measured data set."""
    import simgap.data

    typer.echo(f"{name} is in {simgap.data.fetch(name)}")


@app.command(short_help="Say what a data set holds, or why it is refused.")
def check(
    name: Data,
    inputs: Inputs = None,
    outputs: Outputs = None,
    dt: SamplingTime = None,
    kind: KindOf = None,
    resample: Resample = None,
    split_gaps: SplitGaps = False,
    json: Json = None,
) -> None:
    """Read a data set as `run` would, refuse it with a reason, or say what it holds."""
    from simgap.data import describe

    check_writable(json, read=[name])
    described = describe(read_data(name, inputs, outputs, dt, kind, resample, split_gaps).dataset)
    if json is not None:
        write_json(json, described)
    typer.echo(f"{described['name']}: usable, sampled every {described['sampling_time']:g} s")
    for split, counts in described["splits"].items():
        typer.echo(f"  {split:5}  experiments: {counts['experiments']}, samples: {counts['samples']}")
    typer.echo(f"  n_init {described['n_init']}")
    for role in ("inputs", "outputs"):
        for channel in described[role]:
            low, high, unit = channel["low"], channel["high"], channel["unit"]
            about = f"  {role[:-1]:6} {channel['name']}: {low:.4g} to {high:.4g} {unit} ({channel['kind']})"
            if role == "inputs":
                about += f", {_whiteness(channel['white_experiments'], described['splits']['train']['experiments'])}"
            typer.echo(about)


def _whiteness(white: int, trained: int) -> str:
    if not white:
        return "not white in any training experiment"
    return f"white in {white} of {trained} training experiment{'' if trained == 1 else 's'}"
