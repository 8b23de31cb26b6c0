"""`save`: a data set as a folder in the format that `load` reads."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import numpy as np

from simgap.data.formats.description import FILE, NOT_WRITTEN, SPLITS, check_columns, columns_of
from simgap.data.formats.folder import natural_order
from simgap.data.formats.plant_writing import plant_lines
from simgap.records import Channels, Dataset, Experiment, UnusableInput


def save(dataset: Dataset, folder: str | Path) -> None:
    """Write `dataset` to a new or empty folder; `load(folder)` gives the same arrays, bit for bit.

    Raises UnusableInput when the folder holds anything, or when the format cannot express the data set.
    """
    folder = Path(folder)
    splits = dict(zip(SPLITS, (dataset.training.train, dataset.training.valid, dataset.test), strict=True))
    if not splits["valid"]:
        raise UnusableInput(f"{dataset.name} has no validation experiments; hold some out before saving it")
    check_columns(columns_of(dataset.channels), dataset.name)
    _make_empty(folder)
    time = None if "t" in columns_of(dataset.channels) else "t"
    for split, experiments in splits.items():
        (folder / split).mkdir()
        for stem, experiment in zip(_stems(experiments), experiments, strict=True):
            _write_experiment(folder / split / f"{stem}.csv", experiment, dataset.channels, time)
    # Last, so that a folder which was left half written is no data set.
    (folder / FILE).write_text(_toml(dataset, time), encoding="utf-8")


def _make_empty(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        occupied = any(folder.iterdir())
    except OSError as error:
        raise UnusableInput(f"{folder} cannot be made a folder ({error.strerror}); choose another") from error
    if occupied:
        raise UnusableInput(f"{folder} is not empty; choose a new folder, nothing is overwritten")


def _stems(experiments: tuple[Experiment, ...]) -> list[str]:
    """Make file names without ending of the experiments' names, numbered where those do not keep the order."""
    stems = [re.sub(r"[^\w.\-]", "_", experiment.name)[:80].strip(".") for experiment in experiments]
    keys = [natural_order(stem) for stem in stems]
    unique = len({stem.casefold() for stem in stems}) == len(stems)
    if all(stems) and unique and keys == sorted(keys):
        return stems
    width = len(str(len(stems) - 1))
    return [f"{i:0{width}d}_{stem}" for i, stem in enumerate(stems)]


def _write_experiment(file: Path, experiment: Experiment, channels: Channels, time: str | None) -> None:
    table = np.column_stack([experiment.u, experiment.y])  # [T, nu + ny]
    names = columns_of(channels)
    if time is not None:
        table = np.column_stack([np.arange(len(experiment)) * experiment.dt, table])
        names = (time, *names)
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(names)
        writer.writerows(table.tolist())  # csv writes floats by repr, which loses no bit


def _toml(dataset: Dataset, time: str | None) -> str:
    lines = [f"name = {_quoted(dataset.name)}", f"sampling_time = {dataset.training.dt!r}  # s"]
    if time is not None:
        lines.append(f"time = {_quoted(time)}")
    lines.append(f"n_init = {dataset.n_init}")
    for key, channels in (("inputs", dataset.channels.inputs), ("outputs", dataset.channels.outputs)):
        for channel in channels:
            lines += ["", f"[[{key}]]", f"name = {_quoted(channel.name)}"]
            lines.append(f"unit = {_quoted(channel.unit)}")
            if key == "inputs" and channel.kind_from != "written":
                continue  # its name and unit tell it again
            if channel.kind_from != "unknown" or channel.kind != "other":
                lines.append(f"kind = {_quoted(channel.kind)}")
            if channel.kind_from in NOT_WRITTEN:
                lines.append(f"kind_from = {_quoted(channel.kind_from)}")
    lines += ["", "[splits]", *(f'{split} = "{split}/*.csv"' for split in SPLITS)]
    if dataset.channels.plant is not None:
        lines += plant_lines(dataset.channels.plant, dataset.channels)
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    """Write a TOML basic string; JSON escapes the same way."""
    return json.dumps(text, ensure_ascii=False)
