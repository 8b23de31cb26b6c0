"""`read_csv`: a CSV file as a table, by pandas where it is long and plain, else by the strict reader."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

import numpy as np

from simgap.data.formats.strict_csv import NUMBER_CHARACTERS, strict_table
from simgap.data.formats.tables import Table
from simgap.records import UnusableInput

LONG = 1 << 18  # bytes; a shorter file is read before pandas is imported
PLAIN = "".join(NUMBER_CHARACTERS).encode() + b",\n"


def read_csv(path: Path) -> Table:
    """Read a CSV file as a table; rows are named by line, the header is line 1.

    Raises UnusableInput for anything but UTF-8 text with commas, one header line and one line per sample.
    """
    try:
        if not path.is_file():  # a pipe would never end
            raise UnusableInput(f"{path} is missing or no ordinary file; give a CSV file")
        content = path.read_bytes()
    except OSError as error:
        raise UnusableInput(f"{path} cannot be read ({error.strerror}); check its permissions") from error
    table = plain_table(path, content) if len(content) >= LONG else None
    # The strict reader finds the fault of a file that the fast one leaves, if there is one.
    return table or strict_table(path, content)


def plain_table(path: Path, content: bytes) -> Table | None:
    """Read a file of several columns of plain numbers, to the bit as the strict reader would; give None for any other.

    Pandas says here only whether every row has the same number of cells and every cell is a number. What it
    would take beyond that, such as nan, quotes and cells longer than the csv module allows, is looked for before.
    """
    header, _, body = content.replace(b"\r\n", b"\n").partition(b"\n")
    body = body.rstrip(b"\n")
    ends = np.flatnonzero(np.frombuffer(body, np.uint8) == ord("\n"))
    longest = np.diff(ends, prepend=-1, append=len(body)).max()
    names = _names(header)
    if len(names) < 2 or body.translate(None, PLAIN) or longest > csv.field_size_limit():
        return None
    try:
        columns = _columns(body)
    except ValueError:
        return None
    return Table(str(path), names, columns, first_row=2, parse=_unchanged) if len(columns) == len(names) else None


def _names(header: bytes) -> tuple[str, ...]:
    """Split the names of the columns; give none where the header needs more than a look for its commas."""
    try:
        text = header.decode("utf-8-sig")
    except UnicodeDecodeError:
        return ()
    return () if set(text) & set('"\r\0') else tuple(name.strip() for name in text.split(","))


def _columns(body: bytes) -> tuple[np.ndarray, ...]:
    import pandas as pd

    # Until 3.0 the usual conversion of pandas could miss the last bit; from 3.1 on there is only the exact one.
    old = tuple(map(int, pd.__version__.split(".")[:2])) < (3, 1)
    exact: dict[str, Any] = {"float_precision": "round_trip"} if old else {}
    frame = pd.read_csv(
        io.BytesIO(body), header=None, dtype=np.float64, na_filter=False, skip_blank_lines=False, low_memory=False,
        **exact,
    )  # fmt: skip
    return tuple(frame[column].to_numpy() for column in frame)


def _unchanged(column: np.ndarray) -> np.ndarray:
    return column
