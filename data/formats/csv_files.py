"""`read_csv`: a CSV file as a table, by pandas where it is long and plain, else by the strict reader."""

from __future__ import annotations

import csv
import io
import re
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from simgap.data.formats.layout import Layout, layout_of
from simgap.data.formats.strict_csv import NUMBER_CHARACTERS, parse_text, strict_table
from simgap.data.formats.tables import Table
from simgap.records import UnusableInput

LONG = 1 << 18  # bytes; a shorter file is read before pandas is imported
PLAIN = "".join(NUMBER_CHARACTERS).encode() + b",\n"
WITHIN = re.compile(rb"[eE+-] |[0-9.] +[eE.]")  # a space that pandas overlooks within a number
STAMPS = b":TZ"  # what dates and times of day have besides


def read_csv(path: Path) -> Table:
    """Read a CSV file as a table; rows are named by line, the first line of the file is 1.

    Raises UnusableInput for anything but UTF-8 text with one header line and one line per sample.
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

    One column may hold dates. Pandas says here only whether every row has the same number of cells and every cell is
    a number. What it would take beyond that, such as nan, quotes and cells longer than the csv module allows, is
    looked for before.
    """
    try:
        layout = layout_of(content.decode("utf-8-sig"))
    except UnicodeDecodeError:
        return None
    *before, body = content.replace(b"\r\n", b"\n").split(b"\n", layout.first_row - 1)
    if len(before) < layout.first_row - 1 or any(b"\r" in line for line in before):
        return None
    body, names = _with_commas(body.rstrip(b"\n"), layout), _names(before[layout.skipped], layout)
    dates = _dates(body)
    if len(names) < 2 or dates is None or _longest_line(body) > csv.field_size_limit():
        return None
    try:
        columns = _columns(body, dates)
    except ValueError:
        return None
    table = Table(str(path), names, columns, layout.first_row, _parse, layout.skipped + 1, layout)
    return table if len(columns) == len(names) else None


def _with_commas(body: bytes, layout: Layout) -> bytes:
    """Write the samples with commas between and points within numbers; nothing where that would change them."""
    if layout.separator == ",":
        return body
    if (b"." if layout.decimal == "," else b",") in body:
        return b""
    marks = (layout.separator + layout.decimal.strip(".")).encode()
    return body.translate(bytes.maketrans(marks, b",."[: len(marks)]))


def _dates(body: bytes) -> list[int] | None:
    """Find the columns of dates by the first row; None where the samples hold more than numbers and dates."""
    odd = body.translate(None, PLAIN)
    if odd.translate(None, STAMPS) or WITHIN.search(body):
        return None
    first = body.partition(b"\n")[0].split(b",") if odd else []
    return [i for i, cell in enumerate(first) if cell.translate(None, STAMPS) != cell]


def _longest_line(body: bytes) -> int:
    ends = np.flatnonzero(np.frombuffer(body, np.uint8) == ord("\n"))
    return int(np.diff(ends, prepend=-1, append=len(body)).max())


def _names(header: bytes, layout: Layout) -> tuple[str, ...]:
    """Split the names of the columns; give none where the header needs more than a look for its separators."""
    text = header.decode("utf-8-sig")
    if layout.header_is_comment:
        text = text.lstrip("# ")
    return () if set(text) & set('"\r\0') else tuple(name.strip() for name in text.split(layout.separator))


def _columns(body: bytes, dates: list[int]) -> tuple[Any, ...]:
    """Read the columns, those of `dates` as text."""
    import pandas as pd

    # Until 3.0 the usual conversion of pandas could miss the last bit; from 3.1 on there is only the exact one.
    old = tuple(map(int, pd.__version__.split(".")[:2])) < (3, 1)
    exact: dict[str, Any] = {"float_precision": "round_trip"} if old else {}
    dtype: Any = defaultdict(lambda: np.float64, dict.fromkeys(dates, str)) if dates else np.float64
    frame = pd.read_csv(
        io.BytesIO(body), header=None, dtype=dtype, na_filter=False, skip_blank_lines=False, low_memory=False,
        **exact,
    )  # fmt: skip
    return tuple(frame[column].tolist() if column in dates else frame[column].to_numpy() for column in frame)


def _parse(column: Any) -> np.ndarray:
    return column if isinstance(column, np.ndarray) else parse_text(column)
