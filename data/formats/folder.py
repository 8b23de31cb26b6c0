"""A data set folder: dataset.toml and one CSV file per experiment."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath, PureWindowsPath

from simgap.data.formats.csv_files import read_csv
from simgap.data.formats.description import FILE, Description, read_description
from simgap.data.formats.headings import find
from simgap.data.formats.plant_table import check_records
from simgap.data.formats.sampling import check_time
from simgap.data.formats.tables import Table
from simgap.data.splits import assemble, hold_out_tails
from simgap.records import Channel, Dataset, Experiment, UnusableInput
from simgap.units import plain


def load_folder(folder: Path, more: Sequence[str] = ()) -> Dataset:
    """Read the data set in `folder`, with `more` columns of its files behind the outputs that it describes.

    Raises UnusableInput when any of its files cannot be used.
    """
    described = read_description(folder / FILE)
    known = [channel.name for channel in described.channels.outputs]
    added = tuple(Channel(column) for column in more if column not in known)
    channels = replace(described.channels, outputs=described.channels.outputs + added)
    described = replace(described, channels=channels)
    files = {split: _matching(folder, split, pattern) for split, pattern in described.splits.items()}
    names = _experiment_names(folder, files)
    records = {
        split: tuple(_experiment(file, names[file], described) for file in found) for split, found in files.items()
    }
    if described.channels.plant is not None:
        every = [x for found in records.values() for x in found]
        check_records(described.channels.plant, every, described.channels, str(folder / FILE))
    train = records["train"]
    if "valid" in records:
        valid = records["valid"]
    else:
        train, valid = hold_out_tails(train)
    splits = (train, valid, records["test"])
    return assemble(described.name, splits, described.channels, described.n_init, str(folder))


def natural_order(name: str) -> tuple[list[str | int], str]:
    """Make a sort key that puts "run_10" after "run_9"; no two names share a key."""
    return [int(part) if i % 2 else part for i, part in enumerate(re.split(r"(\d+)", name))], name


def _experiment(file: Path, name: str, described: Description) -> Experiment:
    table = read_csv(file)
    if described.time is not None:
        check_time(table, described.time, described.sampling_time)
    inputs = [channel.name for channel in described.channels.inputs]
    outputs = [channel.name for channel in described.channels.outputs]
    for channel in (*described.channels.inputs, *described.channels.outputs):
        check_unit(table, channel)
    return table.experiment(name, inputs, outputs, described.sampling_time)


def check_unit(table: Table, channel: Channel) -> None:
    """Raise UnusableInput where the heading of a file says another unit than the data set has."""
    found = find(table.names, channel.name)
    unit = table.heading(table.names[found[0]]).unit if len(found) == 1 else ""
    if unit and channel.unit and plain(unit) != plain(channel.unit):
        raise UnusableInput(f"{table.source}: {channel.name} is in {unit}, but in {channel.unit} in the data set; "
                            "convert the column")  # fmt: skip


def _matching(folder: Path, split: str, pattern: str) -> list[Path]:
    """Find the files of a split, in natural order. Raises UnusableInput for none and for one outside the folder."""
    where = f"{folder / FILE}: splits.{split} = {pattern!r}"
    for flavour in (PurePosixPath(pattern), PureWindowsPath(pattern)):
        if flavour.anchor or ".." in flavour.parts or not flavour.parts:
            raise UnusableInput(f"{where} leads out of the folder; write it like 'train/*.csv'")
    try:
        found = sorted(folder.glob(pattern), key=lambda file: natural_order(file.relative_to(folder).as_posix()))
        inside = [file.resolve().is_relative_to(folder.resolve()) for file in found]
    except (ValueError, NotImplementedError, OSError, RuntimeError) as error:  # the last for loops of links
        raise UnusableInput(f"{where} is no usable pattern ({error}); write it like 'train/*.csv'") from None
    if not found:
        raise UnusableInput(f"{where} matches no file; add files or correct the pattern")
    for file, is_inside in zip(found, inside, strict=True):
        if not is_inside:
            raise UnusableInput(f"{where} matches {file}, a link out of the folder; copy the file into the folder")
        if file.is_dir():
            raise UnusableInput(f"{where} matches {file}, a folder; let it match CSV files only")
    return found


def _experiment_names(folder: Path, files: dict[str, list[Path]]) -> dict[Path, str]:
    """Name the experiment of each file: the bare file name where that is unique, else more of the path."""
    every = [file for found in files.values() for file in found]
    seen: set[Path] = set()
    for file in every:
        if file.resolve() in seen:
            raise UnusableInput(f"{file} stands in the splits twice; test on what no model has seen")
        seen.add(file.resolve())
    inside = [file.relative_to(folder) for file in every]
    for names in (
        [file.stem for file in inside],
        ["_".join(file.with_suffix("").parts) for file in inside],
        [file.as_posix() for file in inside],
    ):
        if len(set(names)) == len(names):
            break
    return dict(zip(every, names, strict=True))
