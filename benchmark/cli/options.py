"""Options that several commands share."""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from simgap.records import UnusableInput

if TYPE_CHECKING:
    from simgap.data import Reading

Data = Annotated[str, typer.Argument(help="Name of a data set, a folder or a CSV file.")]
DataOrLogs = Annotated[
    list[str], typer.Argument(help="Name of a data set, a folder, a CSV file, or several logs of one machine.")
]
Inputs = Annotated[list[str] | None, typer.Option("--input", help="Input column of a CSV file; repeatable.")]
Outputs = Annotated[list[str] | None, typer.Option("--output", help="Output column; repeatable.")]
SamplingTime = Annotated[float | None, typer.Option("--dt", help="Sampling time of a CSV file in seconds.")]
KindOf = Annotated[
    list[str] | None,
    typer.Option(
        "--kind",
        help="What the output is: position, velocity, level or other; NAME=KIND where there are several; repeatable.",
    ),
]
Resample = Annotated[
    float | None, typer.Option("--resample", metavar="DT", help="Interpolate onto an even grid of DT seconds.")
]
KnownOf = Annotated[
    list[str] | None,
    typer.Option(
        "--known",
        help="What grey boxes are told of the machine: mass=0.5kg, arm=0.1m, controller.goal=r; repeatable.",
    ),
]
SplitGaps = Annotated[
    bool, typer.Option("--split-gaps", help="Start a new experiment at each gap in time and after missing cells.")
]
Json = Annotated[Path | None, typer.Option("--json", help="Write the same as JSON into this file.")]


def names(text: str | None) -> list[str] | None:
    """ "a,b" as ["a", "b"]; None stays None."""
    return None if text is None else [name.strip() for name in text.split(",") if name.strip()]


def refuse(given: dict[str, Any], why: str) -> None:
    """Raise UnusableInput for the first of these options that was given, by its name without the dashes."""
    if named := [name for name, value in given.items() if value]:
        raise UnusableInput(f"--{named[0]}: {why}")


def parse_params(pairs: Sequence[str]) -> dict[str, Any]:
    """["na=3"] as {"na": 3}, with the types of TOML. Raises UnusableInput."""
    params = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not (name.isidentifier() and equals):
            raise UnusableInput(f"--param {pair}: write it as name=value")
        if name in params:
            raise UnusableInput(f"--param {pair}: {name} is given twice; leave one out")
        try:
            params[name] = tomllib.loads(f"value = {text}")["value"]
        except (ValueError, RecursionError):  # TOMLDecodeError, a date in month 13, lists in lists without end
            params[name] = text  # a word without quotes
    return params


def parse_kinds(pairs: Sequence[str]) -> str | dict[str, str] | None:
    """["v=velocity"] as {"v": "velocity"}; a single ["velocity"] as it is. Raises UnusableInput."""
    if len(pairs) == 1 and "=" not in pairs[0]:
        return pairs[0].strip()
    kinds = {}
    for pair in pairs:
        name, equals, kind = pair.rpartition("=")
        if not (equals and name.strip()):
            raise UnusableInput(f"--kind {pair}: write it as NAME=KIND where there are several outputs")
        if name.strip() in kinds:
            raise UnusableInput(f"--kind {pair}: the kind of {name.strip()} is given twice; leave one out")
        kinds[name.strip()] = kind.strip()
    return kinds or None


def parse_limits(option: str, given: Sequence[str], count: int) -> Any:
    """["-5,5"] as (-5, 5), ["u=40"] as {"u": 40}: so many numbers each; None for none. Raises UnusableInput."""
    limits: dict[str, Any] = {}
    for text in given:
        name, _, numbers = text.rpartition("=")
        try:
            values = [float(number) for number in numbers.split(",")]
        except ValueError:
            values = []
        if len(values) != count:
            form = "LOW,HIGH" if count == 2 else "a number"
            raise UnusableInput(f"--{option} {text}: write {form}, or NAME={form} where there are several columns")
        if name.strip() in limits or "" in limits or (limits and not name.strip()):
            raise UnusableInput(f"--{option} {text}: say once of which column each limit is, as NAME=..")
        limits[name.strip()] = tuple(values) if count > 1 else values[0]
    return limits.get("", limits or None)


def read_data(
    data: str | Sequence[str],
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    dt: float | None = None,
    kind: Sequence[str] | None = None,
    resample: float | None = None,
    split_gaps: bool = False,
    known: Sequence[str] | None = None,
    simulated: Sequence[str] | None = None,
) -> Reading:
    """Load the data of a command and print in one line what was inferred, if anything was. Raises UnusableInput."""
    from simgap.data import read
    from simgap.data.formats.plant_table import parse_known

    kinds, machine = parse_kinds(kind or ()), parse_known(known or ())
    columns = (inputs or (), outputs or ())
    source = data if isinstance(data, str) or len(data) > 1 else data[0]
    reading = read(source, *columns, dt, None, kinds, resample, split_gaps, machine, simulated or ())
    if str(reading):
        typer.echo(str(reading))
    return reading


@contextmanager
def model_faults(step: str) -> Iterator[None]:
    """End with exit code 1 and one line, not our traceback, where a model raises something of its own in a step."""
    from simgap.running import fitting

    try:
        yield
    except (UnusableInput, KeyboardInterrupt, OSError, typer.Exit):
        raise
    except Exception as error:
        typer.echo(f"simgap: {fitting.reason(step, error)}", err=True)
        raise typer.Exit(1) from None


def check_writable(*files: Path | None, read: Sequence[str] = ()) -> None:
    """Raises UnusableInput, before any work is done, for a file that cannot be written, or where one would be lost.

    Two outputs may not go into one file, and none into a file that is `read`: data, a model, a suite.
    """
    from simgap.registry import file_of

    sources = [Path(file_of(source) or source) for source in read]
    wanted = [file for file in files if file is not None]
    for i, file in enumerate(wanted):
        if file.is_dir() or not file.parent.is_dir() or not os.access(file if file.exists() else file.parent, os.W_OK):
            raise UnusableInput(f"{file} cannot be written: give a file in a folder that exists and is yours to write")
        if any(file.resolve() == other.resolve() for other in wanted[:i]):
            raise UnusableInput(f"{file} is named twice; give each output a file of its own")
        if file.exists() and any(_is_of(file, source) for source in sources):
            raise UnusableInput(f"{file} is read, and would be overwritten; give another file")


def _is_of(file: Path, source: Path) -> bool:
    """Tell whether a file is this source, or one of the data in this folder."""
    from simgap.data.formats.logs import ENDINGS

    if source.is_dir():
        return file.suffix.lower() in (*ENDINGS, ".toml") and source.resolve() in file.resolve().parents
    return source.exists() and file.samefile(source)


def write_json(path: Path, value: Any) -> None:
    """Strict JSON, indented."""
    path.write_text(json.dumps(value, indent=1, allow_nan=False, ensure_ascii=False) + "\n", encoding="utf-8")
