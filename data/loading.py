"""`load`: one way in for registered data sets, folders, CSV files and DataFrames."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from simgap.data.formats.csv_files import read_csv
from simgap.data.formats.description import check_columns
from simgap.data.formats.folder import load_folder
from simgap.data.formats.sampling import check_time, sampling_time
from simgap.data.formats.tables import Table
from simgap.data.splits import assemble, split_in_time
from simgap.records import LARGEST_VALUE, Channel, Channels, Dataset, UnusableInput
from simgap.registry import DATASETS

TIME_COLUMNS = ("t", "time")


def load(
    source: Any,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    dt: float | None = None,
    name: str | None = None,
) -> Dataset:
    """Load a data set: a registered name, a folder with dataset.toml, a CSV file or a pandas DataFrame.

    A CSV file and a DataFrame are one record: `inputs` and `outputs` name its columns, the sampling time is
    that of the column "t" or "time" or `dt` in seconds, and the record is split in time 60/20/20.
    Raises UnusableInput when the data cannot be used, and its subclass Missing when they are not at hand.
    """
    declared = bool(inputs or outputs or dt is not None or name is not None)
    if isinstance(source, str) and source in DATASETS:
        _refuse_columns(declared, f"data set {source}")
        return DATASETS[source]()
    if not isinstance(source, str | os.PathLike):
        from simgap.data.formats.frames import table_of  # pandas is slow to import

        return _dataset_of(table_of(source), inputs, outputs, dt, name or "DataFrame")
    path = Path(source)
    if os.path.isdir(source):  # noqa: PTH112  # unlike Path.is_dir it never raises, whatever the text
        _refuse_columns(declared, f"folder {path}")
        return load_folder(path)
    if not os.path.exists(source):  # noqa: PTH110
        raise UnusableInput(
            f"there is no data set, folder or CSV file called {os.fspath(source)!r}; "
            f"known data sets are {', '.join(DATASETS.names())}"
        )
    return _dataset_of(read_csv(path), inputs, outputs, dt, name or path.stem)


def _refuse_columns(declared: bool, source: str) -> None:
    if declared:
        raise UnusableInput(f"{source} knows its columns, sampling time and name; leave those arguments out")


def _dataset_of(table: Table, inputs: Sequence[str], outputs: Sequence[str], dt: float | None, name: str) -> Dataset:
    for column_list, role in ((inputs, "inputs"), (outputs, "outputs")):
        if isinstance(column_list, str) or not column_list:
            raise UnusableInput(
                f"{table.source}: say which columns are the {role} (--{role[:-1]} NAME, or {role}=[..] in Python); "
                f"there are {', '.join(map(repr, table.names[:20]))}"
            )
    if dt is not None and not 0 < dt <= LARGEST_VALUE:
        raise UnusableInput(f"{table.source}: dt = {dt} must be a positive number of seconds, such as 0.1")
    check_columns((*inputs, *outputs), table.source)
    for column in (*inputs, *outputs):
        table.cells_of(column)  # a misspelt column is a better answer than a missing sampling time
    channels = Channels(tuple(map(Channel, inputs)), tuple(map(Channel, outputs)))
    record = table.experiment("record", channels, _sampling_time(table, {*inputs, *outputs}, dt))
    return assemble(name, split_in_time(record), channels, None, table.source)


def _sampling_time(table: Table, used: set[str], dt: float | None) -> float:
    times = [column for column in TIME_COLUMNS if column in table.names and column not in used]
    if len(times) > 1:
        raise UnusableInput(f"{table.source}: columns 't' and 'time' both look like the time; rename one")
    if dt is None and not times:
        raise UnusableInput(
            f"{table.source}: the sampling time is not known; give dt in seconds or a column 't' or 'time'"
        )
    if dt is None:
        return sampling_time(table, times[0])
    for column in times:
        check_time(table, column, dt)
    return float(dt)
