"""A line of the store to a Result: fast where it is one, and in words what is wrong where it is not."""

from __future__ import annotations

import json
import sys
from typing import Any, Literal, get_args, get_type_hints

import msgspec

from simgap.records import Result, Status, UnusableInput

# Larger ones are no floating-point numbers; infinities are written as texts.
LARGEST_NUMBER = sys.float_info.max

Number = int | float | Literal["inf", "-inf"]
Figures = dict[str, Number | dict[str, Number]]


class StoredRow(msgspec.Struct, forbid_unknown_fields=True):
    """The fields of a Result as they stand in a line."""

    model: str
    params: dict[str, Any]
    dataset: str
    experiment: str
    task: str
    seed: int
    status: Status
    metrics: dict[str, Figures] = {}
    units: dict[str, str] = {}
    fitted: dict[str, Any] = {}
    n_params: int | None = None
    fit_seconds: int | float | None = None
    simulate_seconds: int | float | None = None
    message: str = ""
    provenance: dict[str, Any] = {}
    schema: Literal[1] = 1
    valid_nrmse: int | float | None = None


_TYPES = get_type_hints(StoredRow)
_REQUIRED = tuple(field.name for field in msgspec.structs.fields(StoredRow) if field.required)
_LIMITED = ("seed", "n_params", "fit_seconds", "simulate_seconds", "valid_nrmse")
_DECODER = msgspec.json.Decoder(StoredRow)


def decode(line: bytes, where: str) -> Result:
    """The result in a line. Raises UnusableInput, which begins with `where`, for what is none."""
    try:
        row = _DECODER.decode(line)
    except (msgspec.MsgspecError, ValueError, RecursionError) as error:
        raise UnusableInput(f"{where}: {_wrong_in(line, error)}") from error
    for name in _LIMITED:
        if not abs(getattr(row, name) or 0) <= LARGEST_NUMBER:
            raise UnusableInput(f"{where}: {name} is larger than it can be")
    for figures in row.metrics.values():
        _read_infinities(figures, where)
        needed = ("rmse", "std") if figures.get("n_scored") else ("rmse",)
        for name in needed:
            if not isinstance(figures.get(name), int | float):
                raise UnusableInput(f"{where}: the metrics of an output lack the number {name}")
    return Result(*msgspec.structs.astuple(row))


def _read_infinities(figures: dict[str, Any], where: str) -> None:
    for name, value in figures.items():
        if isinstance(value, dict):
            _read_infinities(value, where)
        elif isinstance(value, str):
            figures[name] = float(value)
        elif not abs(value) <= LARGEST_NUMBER:
            raise UnusableInput(f"{where}: {_no_number(name, value)}")


def _wrong_in(line: bytes, error: Exception) -> str:
    """What is wrong with a line that could not be decoded, by its fields."""
    try:
        row = json.loads(line, parse_constant=_refuse)
    except (ValueError, RecursionError) as worse:  # bytes that are not UTF-8 are a ValueError too
        return f"this is no line of results: {worse}"
    if not isinstance(row, dict):
        return f"this is no line of results but a {type(row).__name__}"
    for name, value in row.items():
        if name not in _TYPES:
            return f"unknown field {name!r}; was this written by a newer simgap?"
        if not _fits(value, _TYPES[name]):
            return _wrong_field(name, value)
    if missing := [name for name in _REQUIRED if name not in row]:
        return f"the field {missing[0]!r} is missing"
    return f"this is no line of results: {error}"


def _wrong_field(name: str, value: Any) -> str:
    if name == "status" and isinstance(value, str):
        return f"the status {value!r} is none of {', '.join(get_args(Status))}"
    if name == "schema" and type(value) is int:
        return f"schema {value} is unknown; this simgap reads schema 1"
    if name == "units" and isinstance(value, dict):
        return "the units of outputs are texts"
    if name == "metrics" and isinstance(value, dict):
        return _wrong_metrics(value)
    return f"{name} is a {type(value).__name__}, which it cannot be"


def _wrong_metrics(metrics: dict[str, Any]) -> str:
    for figures in metrics.values():
        if not isinstance(figures, dict):
            return f"the metrics of an output are a {type(figures).__name__}, not figures by name"
        for name, value in figures.items():
            for inner, number in value.items() if isinstance(value, dict) else ((name, value),):
                if not _fits(number, Number):
                    return _no_number(inner, number)
    return "metrics cannot be read"


def _no_number(name: str, value: Any) -> str:
    return f"the metric {name!r} is {str(value)[:40]!r}, which is no number"


def _fits(value: Any, kind: Any) -> bool:
    try:
        msgspec.convert(value, kind)
    except (msgspec.MsgspecError, RecursionError):
        return False
    return True


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is not JSON; infinities are written as strings")
