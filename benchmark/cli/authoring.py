"""`simgap new-model` and `simgap try-model`: from nothing to a model of one's own."""

from __future__ import annotations

import keyword
import re
import time
from pathlib import Path
from typing import Annotated

import typer

from simgap.cli.options import Json, check_writable, parse_params, write_json
from simgap.records import UnusableInput

TEMPLATE = Path(__file__).parents[1] / "templates" / "new_model.py.txt"


def new_model(
    name: Annotated[str, typer.Argument(help="Its name in tables: lower case with underscores.")],
    folder: Annotated[Path, typer.Option(help="Where the file is written.")] = Path(),
) -> None:
    """Write a working model into NAME.py, to change into one's own."""
    from simgap.registry import MODELS

    if not re.fullmatch(r"[a-z][a-z0-9_]{0,39}", name) or keyword.iskeyword(name):
        raise UnusableInput(f"{name!r} is no name for a model; use lower case letters, digits and '_', at most 40")
    if name in MODELS:
        raise UnusableInput(f"there is a model called {name} already; choose another name")
    file = folder / f"{name}.py"
    if file.exists():
        raise UnusableInput(f"{file} is there already and was left as it is")
    check_writable(file)
    kind = "".join(part.capitalize() for part in name.split("_"))
    text = TEMPLATE.read_text(encoding="utf-8").replace("NewModel", kind).replace("new_model", name)
    file.write_text(text, encoding="utf-8")
    typer.echo(f"{file} holds a model that works. Change it, then:")
    typer.echo(f"  simgap try-model {file}")
    typer.echo(f"  simgap run smoke --model {file}:{kind} && simgap report")


def try_model(
    model: Annotated[str, typer.Argument(metavar="NAME|FILE", help="Registered name, file.py or file.py:Class.")],
    param: Annotated[list[str] | None, typer.Option(help="Hyper-parameter, name=value; repeatable.")] = None,
    json: Json = None,
) -> None:
    """Say in seconds whether a model keeps its contract, and in words what is wrong."""
    from simgap import contract

    check_writable(json)
    candidate = contract.candidate(model, parse_params(param or ()))
    start = time.perf_counter()
    verdicts = []
    for verdict in contract.examine(candidate):
        verdicts.append(verdict)
        said = f"WRONG  {verdict.check}: {verdict.wrong}" if verdict.wrong else f"ok     {verdict.check}"
        typer.echo(" ".join(said.split("\n")))
    wrong = sum(bool(verdict.wrong) for verdict in verdicts)
    if not wrong:
        error, held = contract.toy_errors(candidate)
        typer.echo(f"free run on a toy plant: RMSE {error**0.5:.3g}, that of holding the last value {held**0.5:.3g}")
    typer.echo(
        f"{len(verdicts) - wrong} of {len(contract.CHECKS)} checks passed in {time.perf_counter() - start:.1f} s"
    )
    if json is not None:
        write_json(json, {"schema": 1, "model": model, "checks": [vars(verdict) for verdict in verdicts]})
    if wrong:
        raise typer.Exit(1)
