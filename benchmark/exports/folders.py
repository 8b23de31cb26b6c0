"""The folder of an export: export.json says what it is, and CSV files hold the records with the expected answers."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from simgap.exports.ranges import ranges_of, to_json
from simgap.exports.subjects import CheckRecord, Subject
from simgap.records import UnusableInput

SCHEMA = 1
ABOUT = "export.json"


@dataclass(frozen=True, eq=False)
class About:
    """What export.json says: dt in s, the names of inputs and outputs, and the records."""

    format: str
    model: str
    dt: float
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    limit: float
    records: tuple[CheckRecord, ...]


def write_folder(subject: Subject, form: str, folder: Path, limit: float) -> None:
    """Write export.json and the records."""
    channels = subject.fitted_on.channels
    inputs, outputs = [c.name for c in channels.inputs], [c.name for c in channels.outputs]
    records = []
    for record in subject.records:
        file = f"{record.name}.csv"
        rows = np.column_stack((record.u, np.concatenate((record.y_init, record.y_hat))))
        with (folder / file).open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow([*inputs, *outputs])
            writer.writerows(rows.tolist())
        records.append({"file": file, "simulated_from_row": record.n, "start": record.start.tolist()})
    about: dict[str, Any] = {
        "schema": SCHEMA, "simgap": version("simgap"), "format": form, "model": subject.name,
        "fitted_on": subject.fitted_on.dataset, "dt": subject.fitted_on.dt, "inputs": inputs, "outputs": outputs,
        "units": {c.name: c.unit for c in channels.inputs + channels.outputs}, "limit": limit,
        "records": records, "ranges": to_json(ranges_of(subject.model, channels)),
    }  # fmt: skip
    (folder / ABOUT).write_text(json.dumps(about, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def read_folder(folder: Path) -> About:
    """Read what `write_folder` wrote. Raises UnusableInput."""
    if not (folder / ABOUT).is_file():
        raise UnusableInput(f"{folder} is no export: it has no {ABOUT}; write one with `simgap export MODEL DATA`")
    try:
        text = json.loads((folder / ABOUT).read_text(encoding="utf-8"))
        if text["schema"] != SCHEMA:
            raise UnusableInput(f"{folder} has schema {text['schema']!r} of exports, this simgap reads {SCHEMA}")
        names = tuple(map(str, text["inputs"])), tuple(map(str, text["outputs"]))
        records = tuple(_read_record(folder, one, *map(len, names)) for one in text["records"])
        return About(str(text["format"]), str(text["model"]), float(text["dt"]), *names, float(text["limit"]), records)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise UnusableInput(f"{folder / ABOUT} cannot be read: {' '.join(str(error).split())}") from error


def file_in(folder: Path, name: str) -> Path:
    """Return a file of an export. Raises UnusableInput where it is missing."""
    if not (folder / name).is_file():
        raise UnusableInput(f"{folder / name} is missing; export once more")
    return folder / name


def _read_record(folder: Path, text: dict[str, Any], nu: int, ny: int) -> CheckRecord:
    name, n = Path(str(text["file"])).name, int(text["simulated_from_row"])
    with file_in(folder, name).open(encoding="utf-8", newline="") as stream:
        _, *rows = csv.reader(stream)  # a name may hold commas and line ends
    values = np.array(rows, dtype=np.float64)
    if values.shape != (len(rows), nu + ny) or not 0 <= n < len(rows):
        raise ValueError(f"{name} holds other columns, or no row to simulate")
    y = values[:, nu:]
    return CheckRecord(Path(name).stem, values[:, :nu], y[:n], y[n:], np.array(text["start"], dtype=np.float64))
