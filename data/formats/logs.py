"""Several logs of one machine with the same columns, as files that are named or in a folder without a dataset.toml."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from simgap.data.formats.description import FILE
from simgap.data.formats.folder import natural_order
from simgap.data.formats.one_record import Choices, OneRecord, record_of
from simgap.data.formats.sampling import DRIFT_TOLERANCE
from simgap.data.formats.tables import Table
from simgap.records import UnusableInput

ENDINGS = (".csv", ".mat", ".parquet", ".txt", ".tsv", ".dat")  # of files of one record; any name may be one
TEXTS = ("readme", "license", "licence")  # names of files that hold none, whatever their ending


def is_described(folder: Path) -> bool:
    """Tell whether a folder holds a dataset.toml."""
    return os.path.isfile(folder / FILE)  # noqa: PTH113  # unlike Path.is_file it never raises


def logs_of(folder: Path) -> list[Path]:
    """List the files of records in a folder, by name: those with the first of the known endings that is there.

    Raises UnusableInput where there is none.
    """
    with suppress(OSError):  # of a folder that may not be read
        files = _that_may_be_logs(folder)
        for ending in ENDINGS:
            found = [file for file in files if file.suffix.lower() == ending]
            if found:
                return found
    raise UnusableInput(
        f"{folder} holds no {FILE} and no CSV file; give a folder of CSV files with the same columns, or a single one"
    )


def not_read(folder: Path) -> tuple[str, ...]:
    """Say which files of a folder are left out although their ending is that of a log."""
    read = logs_of(folder)
    names = [file.name for file in _that_may_be_logs(folder) if file not in read]
    return (f"without {', '.join(names[:3])}{', ..' if names[3:] else ''}",) if names else ()


def _that_may_be_logs(folder: Path) -> list[Path]:
    files = (file for file in folder.iterdir() if file.suffix.lower() in ENDINGS and file.is_file())
    logs = (file for file in files if not file.name.startswith(".") and file.stem.casefold() not in TEXTS)
    return sorted(logs, key=lambda file: natural_order(file.name))


def record_of_logs(tables: Sequence[Table], choices: Choices) -> OneRecord:
    """Read the chosen columns of several logs as the pieces of one record, each under the name of its log.

    Raises UnusableInput where two are sampled differently, or differ in a unit.
    """
    records = [record_of(table, choices) for table in tables]
    if len(records) == 1:
        return records[0]
    first, pieces, names = records[0], [], _names([table.source for table in tables])
    for table, record, name in zip(tables, records, names, strict=True):
        _check_alike(tables[0], first, table, record)
        for x in record.pieces:
            pieces.append(
                replace(x, name=name if len(record.pieces) == 1 else f"{name}_{x.name}", dt=first.pieces[0].dt)
            )
    said = f"{len(tables)} logs, split 60/20/20 in this order: {', '.join(names[:3])}{', ..' if names[3:] else ''}"
    folder = Path(os.path.abspath(tables[0].source)).parent  # noqa: PTH100  # which keeps the name of a link
    return OneRecord(str(folder), tuple(pieces), first.channels, (said, *first.said))


def _names(sources: Sequence[str]) -> list[str]:
    """Name logs by their files; with a number before it where two would be called the same."""
    names = [Path(source).stem for source in sources]
    return names if len(set(names)) == len(names) else [f"{i}_{name}" for i, name in enumerate(names, 1)]


def _check_alike(table: Table, record: OneRecord, other: Table, its: OneRecord) -> None:
    """Raise UnusableInput unless both records have one sampling time, within 1 %, and the same units."""
    dt, its_dt = record.pieces[0].dt, its.pieces[0].dt
    if abs(its_dt - dt) > DRIFT_TOLERANCE * dt:
        raise UnusableInput(
            f"{other.source} is sampled every {its_dt:g} s and {table.source} every {dt:g} s; resample all (--resample "
            f"{max(dt, its_dt):g}), or put them into folders of their own"
        )
    channels, its_channels = ((*x.channels.inputs, *x.channels.outputs) for x in (record, its))
    for channel, its_channel in zip(channels, its_channels, strict=True):
        if channel.unit != its_channel.unit:
            raise UnusableInput(
                f"{other.source}: {its_channel.name!r} is in {its_channel.unit or 'no unit'!r}, but in "
                f"{channel.unit or 'no unit'!r} in {table.source}; convert one of them and correct its heading"
            )
