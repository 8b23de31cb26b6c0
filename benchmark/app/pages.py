"""Pages from templates; whatever comes from a record is text there."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from shlex import quote
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from simgap import wording
from simgap.app.orders import Order, Settings
from simgap.data.kinds import KINDS
from simgap.reports.rendering import printable

HERE = Path(__file__).parent


def page(template: str, **content: Any) -> str:
    """Render a template."""
    return _environment().get_template(template).render(content, wording=wording, kinds=KINDS)


def answer_bar(order: Order, reading: str) -> str:
    """Write what stands above a diagnosis in the app: how the record was read, what can be taken away, and the command.

    It is the one that gives the same answer on the command line.
    """
    source = Path(order.source)
    again = command(order.source, order.settings)
    return page("bar.html", name=source.name, stem=source.stem, reading=reading, command=again)


def command(source: str, said: Settings) -> str:
    """Write the command that gives the same answer; empty where units were corrected, which no option does."""
    if said.units:
        return ""
    name = source.removeprefix("./")
    words = ["simgap", "diagnose", f"./{name}" if name.startswith("-") else name]
    for option, values in (("input", said.inputs), ("output", said.outputs), ("simulated", said.simulated),
                           ("kind", [f"{column}={kind}" for column, kind in said.kinds.items()]),
                           ("dt", [said.dt]), ("resample", [said.resample]), ("known", said.known)):  # fmt: skip
        for value in values:
            if value is not None:
                text = str(value)
                words += [f"--{option}={text}"] if text.startswith("-") else [f"--{option}", text]
    return " ".join(map(quote, [*words, "--split-gaps"] if said.split_gaps else words))


@cache
def _environment() -> Environment:
    return Environment(
        loader=FileSystemLoader(HERE / "templates"), autoescape=True, undefined=StrictUndefined, finalize=_finalize,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip


def _finalize(value: Any) -> Any:
    """Strip what is not printable from a string on its way into the page; markup stays."""
    return printable(value) if isinstance(value, str) and not hasattr(value, "__html__") else value
