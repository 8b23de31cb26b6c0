"""`simgap try-model`: whether a model keeps its contract."""

from __future__ import annotations

import time
from typing import Annotated

import typer

from simgap.cli.options import Json, check_writable, parse_params, write_json


def try_model(
    model: Annotated[str, typer.Argument(metavar="NAME|FILE", help="Registered name, file.py or file.py:Class.")],
    param: Annotated[list[str] | None, typer.Option(help="Hyper-parameter, name=value; repeatable.")] = None,
    json: Json = None,
) -> None:
    """Say in seconds whether a model keeps its contract, and in words what is wrong."""
    from simgap import contract

    check_writable(json, read=[model])
    candidate = contract.candidate(model, parse_params(param or ()))
    start = time.perf_counter()
    results = []
    for result in contract.examine(candidate):
        results.append(result)
        said = f"WRONG  {result.check}: {result.wrong}" if result.wrong else f"ok     {result.check}"
        typer.echo(" ".join(said.split("\n")))
    wrong = sum(bool(result.wrong) for result in results)
    if not wrong:
        error, held = contract.toy_errors(candidate)
        typer.echo(f"free run on a toy plant: RMSE {error**0.5:.3g}, that of holding the last value {held**0.5:.3g}")
    typer.echo(f"{len(results) - wrong} of {len(contract.CHECKS)} checks passed in {time.perf_counter() - start:.1f} s")
    if json is not None:
        write_json(json, {"schema": 1, "model": model, "checks": [vars(result) for result in results]})
    if wrong:
        raise typer.Exit(1)
