"""Files of records that could be taken: their inputs alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float

from simgap.data.formats.clock import read_clock, time_column
from simgap.data.formats.folder import check_unit, natural_order
from simgap.data.formats.logs import ENDINGS
from simgap.data.formats.one_record import Choices
from simgap.data.formats.sampling import check_clock
from simgap.data.loading import read_table
from simgap.records import Dataset, UnusableInput


def read_candidates(source: Path, dataset: Dataset) -> dict[str, Float[np.ndarray, "T nu"]]:
    """Read the input columns of a file, or of every file in a folder, by the file's name without its ending.

    Other columns are not read, but for the time, which has to be that of the data set. Raises UnusableInput.
    """
    if not source.exists():
        raise UnusableInput(f"there is no file or folder {source} with records that could be taken")
    files = [source]
    if source.is_dir():
        found = (file for file in source.iterdir() if file.is_file() and file.suffix.lower() in ENDINGS)
        files = sorted(found, key=lambda file: natural_order(file.name))
        if not files:
            raise UnusableInput(f"{source} holds no file of a record that could be taken ({', '.join(ENDINGS)})")
    if len({file.stem for file in files}) < len(files):
        raise UnusableInput(f"{source} holds two files with the same name but for the ending; rename one")
    return {file.stem: _inputs(file, dataset) for file in files}


def _inputs(file: Path, dataset: Dataset) -> Float[np.ndarray, "T nu"]:
    names = [channel.name for channel in dataset.channels.inputs]
    table = read_table(file, Choices(names))
    columns = [table.index(name) for name in names]
    for channel in dataset.channels.inputs:
        check_unit(table, channel)
    time = time_column(table, set(columns))
    if time is not None:
        check_clock(read_clock(table, time), dataset.training.dt)
    return np.column_stack([table.numbers(table.names[i]) for i in columns])
