"""Results on disk: JSON lines, one file per model and suite, `<folder>/<suite>/<model>.jsonl`."""

from __future__ import annotations

import json
import math
import re
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from simgap.records import Result, UnusableInput
from simgap.results import lines
from simgap.results.decoding import decode

Key = tuple[str, str, str, str, str, int]
NO_SUITES = ("recovery", "artefacts", "site", "figures")  # what else stands in a folder of results


def key(result: Result) -> Key:
    """What a result is about: of two results with one key, the later replaces the earlier."""
    params = json.dumps(plain(result.params), sort_keys=True)
    return (result.model, params, result.dataset, result.experiment, result.task, result.seed)


def path_of(folder: Path, suite: str, model: str) -> Path:
    """The file of one model; a name becomes a file name by replacing what means something in a path."""
    return Path(folder) / file_name(suite) / f"{file_name(model)}.jsonl"


def suites_in(folder: Path) -> list[Path]:
    """The folders of the suites in a folder of results."""
    inside = sorted(path for path in folder.iterdir() if path.is_dir() and path.name not in NO_SUITES)
    return [path for path in inside if any(path.glob("*.jsonl"))]


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
            result = decode(line, f"{file}, line {number}")
            rows[key(result)] = result
    return list(rows.values())


def encode(result: Result) -> str:
    """One line of strict JSON, with infinities as the strings "inf" and "-inf"."""
    return json.dumps(plain(vars(result)), allow_nan=False, ensure_ascii=False)


def encoded(results: Sequence[Result]) -> list[dict[str, Any]]:
    """The results as JSON values, the same as in the lines of the store."""
    return [plain(vars(result)) for result in results]


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


def file_name(name: str) -> str:
    """Make a file name of any name by replacing what means something in a path."""
    return re.sub(r"[^A-Za-z0-9_.-]", "_", name).lstrip(".") or "_"
