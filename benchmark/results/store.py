"""Results on disk: JSON lines, one file per model and suite, `<folder>/<suite>/<model>.jsonl`."""

from __future__ import annotations

import json
import math
import re
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, get_args

from simgap.records import Result, Status, UnusableInput
from simgap.results import lines

Key = tuple[str, str, str, str, str, int]

# Larger ones are no floating-point numbers; infinities are written as texts.
LARGEST_NUMBER = sys.float_info.max

_NUMBER = (int, float, type(None))
_REQUIRED: dict[str, Any] = {
    "model": str, "params": dict, "dataset": str, "experiment": str, "task": str, "seed": int, "status": str,
}  # fmt: skip
_OPTIONAL: dict[str, Any] = {
    "metrics": dict, "units": dict, "fitted": dict, "n_params": (int, type(None)), "fit_seconds": _NUMBER,
    "simulate_seconds": _NUMBER, "message": str, "provenance": dict, "schema": int,
}  # fmt: skip


def key(result: Result) -> Key:
    """What a result is about: of two results with one key, the later replaces the earlier."""
    params = json.dumps(plain(result.params), sort_keys=True)
    return (result.model, params, result.dataset, result.experiment, result.task, result.seed)


def path_of(folder: Path, suite: str, model: str) -> Path:
    """The file of one model; a name becomes a file name by replacing what means something in a path."""
    return Path(folder) / _file_name(suite) / f"{_file_name(model)}.jsonl"


def writable(folder: Path) -> Path:
    """The folder, made if it is not there. Raises UnusableInput, before any work is done, if nothing can be stored."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"0")
    except OSError as error:
        raise UnusableInput(f"results cannot be written into {folder}: {error.strerror or error}") from error
    return folder


def append(folder: Path, suite: str, results: Sequence[Result]) -> None:
    """Write the results of one job with one write per file, under a lock that other processes respect."""
    by_path: dict[Path, list[Result]] = {}
    for result in results:
        by_path.setdefault(path_of(folder, suite, result.model), []).append(result)
    for path, rows in by_path.items():
        lines.append(path, _encoded_lines(rows), lock_of(folder))


def tidy(folder: Path, suite: str, model: str) -> None:
    """Take the results out of a model's file that later ones have replaced, if there are any; all or nothing."""
    from filelock import FileLock

    path = path_of(folder, suite, model)
    if not path.exists():
        return
    with FileLock(lock_of(folder)):
        rows = read(path)
        if len(rows) != path.read_bytes().count(b"\n"):
            lines.replace(path, _encoded_lines(rows))


def lock_of(folder: Path) -> Path:
    """The file that is locked while something is written into a folder of results."""
    return Path(folder) / ".lock"


def read(path: Path) -> list[Result]:
    """The results of one file, or of all files of a suite's folder, without those that were replaced.

    Raises UnusableInput with file and line for what is no result. An unfinished last line is no error: it is
    what an interrupted write leaves.
    """
    rows: dict[Key, Result] = {}
    for file in sorted(path.glob("*.jsonl")) if path.is_dir() else [path]:
        for number, line in enumerate(lines.read(file), start=1):
            result = _decode(line, f"{file}, line {number}")
            rows[key(result)] = result
    return list(rows.values())


def encode(result: Result) -> str:
    """One line of strict JSON, with infinities as the strings "inf" and "-inf"."""
    return json.dumps(plain(asdict(result)), allow_nan=False, ensure_ascii=False)


def encoded(results: Sequence[Result]) -> list[dict[str, Any]]:
    """The results as JSON values, the same as in the lines of the store."""
    return [plain(asdict(result)) for result in results]


def plain(value: Any) -> Any:
    """`value` in the types of JSON: arrays as lists, what is no finite number and no structure as text."""
    if hasattr(value, "tolist"):  # NumPy arrays and scalars
        value = value.tolist()
    if isinstance(value, dict):
        return {str(name): plain(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple | set):
        return [plain(entry) for entry in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, int | bool | None):
        return value
    return str(value).encode("utf-8", "replace").decode()  # half of a pair of surrogates is no UTF-8


def _encoded_lines(rows: Sequence[Result]) -> bytes:
    return "".join(encode(row) + "\n" for row in rows).encode()


def _decode(line: bytes, where: str) -> Result:
    try:
        row = json.loads(line, parse_constant=_refuse)
        if not isinstance(row, dict):
            raise UnusableInput(f"{where}: this is no line of results but a {type(row).__name__}")
        _check_fields(row, where)
        row["metrics"] = {name: _figures(figures, where) for name, figures in row.get("metrics", {}).items()}
        result = Result(**row)
        key(result)
    except (ValueError, RecursionError) as error:  # bytes that are not UTF-8 are a ValueError too
        if isinstance(error, UnusableInput):
            raise
        raise UnusableInput(f"{where}: this is no line of results: {error}") from error
    return result


def _check_fields(row: dict[str, Any], where: str) -> None:
    types = _REQUIRED | _OPTIONAL
    for name, value in row.items():
        if name not in types:
            raise UnusableInput(f"{where}: unknown field {name!r}; was this written by a newer simgap?")
        if not isinstance(value, types[name]) or isinstance(value, bool):
            raise UnusableInput(f"{where}: {name} is a {type(value).__name__}, which it cannot be")
        if isinstance(value, int | float) and not abs(value) <= LARGEST_NUMBER:
            raise UnusableInput(f"{where}: {name} is larger than it can be")
    if missing := [name for name in _REQUIRED if name not in row]:
        raise UnusableInput(f"{where}: the field {missing[0]!r} is missing")
    if row["status"] not in get_args(Status):
        raise UnusableInput(f"{where}: the status {row['status']!r} is none of {', '.join(get_args(Status))}")
    if row.get("schema", 1) != 1:
        raise UnusableInput(f"{where}: schema {row['schema']} is unknown; this simgap reads schema 1")
    if not all(isinstance(unit, str) for unit in row.get("units", {}).values()):
        raise UnusableInput(f"{where}: the units of outputs are texts")


def _figures(figures: Any, where: str) -> dict[str, Any]:
    """The figures of one output; those of a simulation that was scored are all there."""
    if not isinstance(figures, dict):
        raise UnusableInput(f"{where}: the metrics of an output are a {type(figures).__name__}, not figures by name")
    decoded: dict[str, Any] = {}
    for name, value in figures.items():
        if isinstance(value, dict):
            decoded[name] = {inner: _number(number, inner, where) for inner, number in value.items()}
        else:
            decoded[name] = _number(value, name, where)
    needed = ("rmse", "std") if decoded.get("n_scored") else ("rmse",)
    if missing := [name for name in needed if not isinstance(decoded.get(name), int | float)]:
        raise UnusableInput(f"{where}: the metrics of an output lack the number {missing[0]}")
    return decoded


def _number(value: Any, name: str, where: str) -> int | float:
    if value in ("inf", "-inf"):
        return float(value)
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST_NUMBER:
        raise UnusableInput(f"{where}: the metric {name!r} is {str(value)[:40]!r}, which is no number")
    return value


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is not JSON; infinities are written as strings")


def _file_name(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9_.-]", "_", name).lstrip(".") or "_"
