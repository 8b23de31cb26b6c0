"""`simgap new-model`: a file to make one's own model from."""

from __future__ import annotations

import keyword
import re
from pathlib import Path
from typing import Annotated

import typer

from simgap.cli.options import check_writable
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
    typer.echo(f"  simgap run smoke --model {file}:{kind} --models arx --out my_results")
