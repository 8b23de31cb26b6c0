"""`simgap simulate`: a saved model on other records."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from simgap.cli.options import Data, Json, Resample, SamplingTime, SplitGaps, check_writable, write_json


def simulate(
    saved: Annotated[Path, typer.Argument(help="File that `simgap fit --save` or `simgap diagnose --save` wrote.")],
    data: Data,
    experiment: Annotated[str | None, typer.Option(help="Only this experiment; else all to test on.")] = None,
    dt: SamplingTime = None,
    resample: Resample = None,
    split_gaps: SplitGaps = False,
    out: Annotated[Path | None, typer.Option(help="Write time, inputs and outputs into this CSV file.")] = None,
    json: Json = None,
) -> None:
    """Let a saved model run free over a record, and print how far it is from the measured outputs."""
    from rich.console import Console

    from simgap.cli.fit import score_table
    from simgap.records import UnusableInput
    from simgap.reports.rendering import printable
    from simgap.results.store import plain
    from simgap.running import fitting
    from simgap.saved import simulate as on_records
    from simgap.saved.archive import read_saved

    check_writable(out, json, read=[str(saved), data])
    model = read_saved(saved)
    about = model.fitted_on
    try:
        simulations = on_records.simulate(model, data, experiment, dt, resample, split_gaps)
    except UnusableInput:
        raise
    except Exception as error:  # the model's own fault, without our traceback
        typer.echo(f"simgap: {fitting.reason('simulate', error)}", err=True)
        raise typer.Exit(1) from None
    if out is not None and len(simulations) > 1:
        names = ", ".join(one.experiment.name for one in simulations)
        raise UnusableInput(f"--out {out}: a file takes one experiment; choose it with --experiment: {names}")
    units = {channel.name: channel.unit for channel in about.channels.outputs}
    start = f"each simulation starts from n_init = {about.n_init} samples"
    typer.echo(printable(f"{model.name}, fitted on {about.dataset}; {start}"))
    Console().print(score_table((one.experiment.name, one.metrics, units) for one in simulations))
    if json is not None:
        runs = [{"experiment": one.experiment.name, "metrics": one.metrics} for one in simulations]
        about_model = {"model": model.name, "fitted_on": about.dataset, "n_init": about.n_init, "units": units}
        write_json(json, plain({"schema": 1, **about_model, "simulations": runs}))
    if out is not None:
        simulations[0].write(out)
        typer.echo(f"Written: {out}")
