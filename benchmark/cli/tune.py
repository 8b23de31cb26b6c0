"""`simgap tune`: settings of a model for one data set."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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
    parse_params,
    read_data,
    write_json,
)

if TYPE_CHECKING:
    from simgap.running.tuning import Range, Trial


def tune(
    model: Annotated[str, typer.Argument(help="Name of a model, or path/to/file.py:Class.")],
    data: Data,
    inputs: Inputs = None,
    outputs: Outputs = None,
    dt: SamplingTime = None,
    kind: KindOf = None,
    resample: Resample = None,
    split_gaps: SplitGaps = False,
    ranges: Annotated[
        list[str] | None, typer.Option("--range", help="units=8:64, learning_rate=1e-3:1e-2 or l2=0,1e-4; repeatable.")
    ] = None,
    param: Annotated[list[str] | None, typer.Option(help="name=value that stays; repeatable.")] = None,
    seconds: Annotated[float, typer.Option(help="Time for all fits; the one under way is finished.")] = 600.0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the search and of the fits.")] = 0,
    seeds: Annotated[int, typer.Option(help="Fits of each setting, of which the median counts.")] = 1,
    out: Annotated[Path, typer.Option(help="Write the best settings into this file, a suite for `simgap run`.")] = Path(
        "tuned.toml"
    ),
    json: Json = None,
) -> None:
    """Look for the settings whose free run errs least on the validation data.

    The test has no part in it. `simgap run tuned.toml` then fits the model with them and scores it on the test.
    """
    from simgap.running import fitting
    from simgap.running.tuning import tune as search

    check_writable(json, out, read=[data, model])
    params = parse_params(param or ())
    fitting.check_params(model, params)  # first, because data may take seconds to load
    asked = [_range(text) for text in ranges or ()]
    dataset = read_data(data, inputs, outputs, dt, kind, resample, split_gaps).dataset
    tuned = search(model, dataset, asked, seconds, seed, params, seeds, _show)
    if json is not None:
        write_json(json, tuned.to_json())
    out.write_text(tuned.to_suite(data), encoding="utf-8")
    first, best = (100 * trial.error for trial in (tuned.trials[0], tuned.best))
    if tuned.best is tuned.trials[0]:
        typer.echo(f"Nothing better than the settings as they are, {first:.3g} % of the spread, seed {seed}.")
    else:
        typer.echo(f"{first:.3g} -> {best:.3g} % of the spread, seed {seed}; settings in {out}")


def _range(text: str) -> Range:
    """Read "units=8:64" or "l2=0,1e-4", with the types of TOML. Raises UnusableInput."""
    from simgap.records import UnusableInput
    from simgap.running.tuning import Range

    name, _, values = text.partition("=")
    two_ends = ":" in values
    parts = [parse_params([f"{name}={part.strip()}"])[name] for part in values.split(":" if two_ends else ",") if part]
    if not parts or (two_ends and (len(parts) != 2 or not all(isinstance(part, int | float) for part in parts))):
        raise UnusableInput(f"--range {text}: write it as name=low:high or name=one,other")
    return Range(name, *parts) if two_ends else Range(name, choices=tuple(parts))


def _show(trial: Trial) -> None:
    settings = ", ".join(f"{name}={value}" for name, value in trial.params.items()) or "as it is"
    typer.echo(f"{100 * trial.error:8.4g} %  {trial.seconds:6.1f} s  {settings}")
