"""The strict CSV reader: it takes one row after the other, and names the row and the column of the first fault."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from reprlib import repr as short

import numpy as np
from jaxtyping import Float

from simgap.data.formats.layout import LINE, NUMBER, Layout, layout_of
from simgap.data.formats.tables import CORRECT, BadCell, Table, is_missing
from simgap.records import UnusableInput

# What a decimal number is made of. float() alone would also take 1_000, nan, inf and foreign digits.
NUMBER_CHARACTERS = frozenset("0123456789+-.eE ")
# A quoted cell with blanks behind it, which the csv module takes for a fault.
BLANKS_AFTER_QUOTE = re.compile(r'((?:\A|[\t;,\r\n])[ ]*"(?:[^"\r\n]|"")*")[ ]+(?=[\t;,\r\n]|\Z)')
LONGEST_PREAMBLE = 100  # lines above the names of the columns that are looked through
NOT_THE_NAMES = (
    "is taken for the names of the columns, but the rows below do not fit them; begin each line above the names "
    "with # or delete it"
)


def strict_table(path: Path, content: bytes) -> Table:
    """Read the CSV file row by row, its cells as text.

    Raises UnusableInput for anything but UTF-8 text with one header line and one line per sample.
    """
    text = _text(path, content)
    layout = layout_of(text)
    rows = _rows(path, text, layout)
    names = tuple(name.strip() for name in next(rows, []))
    header, first = layout.skipped + 1, layout.first_row
    if not names:
        raise UnusableInput(f"{path}: row {header} is empty; it must name the columns")
    if all(map(NUMBER.fullmatch, names)):
        raise UnusableInput(
            f"{path}: row {header} holds numbers where the columns are named; put a line of names above"
        )
    if len(names) == 1 and set(names[0]) & set("| "):
        if any(len(row) > 1 for row in islice(rows, LONGEST_PREAMBLE)):
            raise UnusableInput(f"{path}: row {header} {NOT_THE_NAMES}")
        raise UnusableInput(
            f"{path}: row {header} has a single cell; begin lines above the names of the columns with #, or separate "
            f"the cells with commas, semicolons or tabs"
        )
    columns: list[list[str]] = [[] for _ in names]
    blank = 0
    for number, row in enumerate(islice(rows, bool(layout.units), None), start=first):
        if not row:  # the line break at the end of a file is no sample
            blank = blank or number
        elif blank:
            raise UnusableInput(f"{path}: row {blank} is empty; delete it or fill in the sample")
        elif len(row) != len(names):
            raise _uneven(path, number, row, names, header)
        else:
            for cells, cell in zip(columns, row, strict=True):
                cells.append(cell)
    if not columns[0]:
        raise UnusableInput(f"{path}: nothing follows row {first - 1}, the names of the columns; add the samples")
    parse = parse_text if layout.decimal == "." else parse_decimal_commas
    return Table(str(path), names, tuple(columns), first, parse, layout.skipped + 1, layout)


def parse_text(cells: Sequence[str]) -> Float[np.ndarray, " T"]:
    """Turn cells of text into float64. Raises BadCell at the first that is not a plain decimal number."""
    if NUMBER_CHARACTERS.issuperset("".join(cells)):
        try:
            return np.array(list(map(float, cells)), dtype=np.float64)
        except ValueError:
            pass  # the search below finds the cell
    for index, cell in enumerate(cells):
        _check_cell(index, cell)
    raise AssertionError("one of the cells is bad, or the fast way above had succeeded")


def parse_decimal_commas(cells: Sequence[str]) -> Float[np.ndarray, " T"]:
    """Turn cells of text with decimal commas into float64. Raises BadCell at the first that is no such number."""
    for index, cell in enumerate(cells):
        if "." in cell:
            raise BadCell(index, f"{short(cell)} has a point where this file has decimal commas; write it like -1,25")
    try:
        return parse_text([cell.replace(",", ".") for cell in cells])
    except BadCell as bad:
        _check_cell(bad.index, cells[bad.index], example="-1,25")
        raise


def _check_cell(index: int, cell: str, example: str = "-1.25") -> None:
    if is_missing(cell):
        raise BadCell(index, f"{short(cell)} is no measurement" if cell.strip() else "the cell is empty", missing=True)
    if cell.strip().lower().lstrip("+-") in ("inf", "infinity"):
        raise BadCell(index, f"{short(cell)} is no measurement; {CORRECT}")
    try:
        float(cell)
        plain = NUMBER_CHARACTERS.issuperset(cell)
    except ValueError:
        plain = False
    if not plain:
        raise BadCell(index, f"{short(cell)} is not a number; write it like {example} or 3e-4")


def _text(path: Path, content: bytes) -> str:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        row = content.count(b"\n", 0, error.start) + 1
        raise UnusableInput(
            f"{path}: row {row} is not UTF-8 text; save the file as CSV in the encoding UTF-8 (in Excel: CSV UTF-8)"
        ) from None
    if "\0" in text:
        row = text.count("\n", 0, text.index("\0")) + 1
        raise UnusableInput(f"{path}: row {row} holds a NUL byte, so this is no text; save the file as CSV")
    if not text.strip():
        raise UnusableInput(f"{path} is empty; give it a line of column names and a line per sample")
    return BLANKS_AFTER_QUOTE.sub(r"\1", text) if '" ' in text else text


def _rows(path: Path, text: str, layout: Layout) -> Iterator[list[str]]:
    """Yield the header and the rows as cells, each checked to be one line, so that row i is line i of the file."""
    at = 0
    for _ in range(layout.skipped):
        at = LINE.match(text, at).end()  # type: ignore[union-attr]  # it matches anywhere
    stream = io.StringIO(text[at:].lstrip("# ") if layout.header_is_comment else text[at:], newline="")
    reader = csv.reader(stream, strict=True, delimiter=layout.separator, skipinitialspace=True)
    number = layout.skipped
    try:
        for number, row in enumerate(reader, start=layout.skipped + 1):
            if reader.line_num != number - layout.skipped:
                raise UnusableInput(
                    f"{path}: row {number}: a cell in quotes runs over several lines; keep each sample on one line"
                )
            yield row
    except csv.Error as error:
        apart = {",": "commas", ";": "semicolons", "\t": "tabs"}[layout.separator]
        why = f"is no CSV: {error}; keep each sample on one line, cells apart by {apart}"
        if "expected after" in str(error):
            why = "has text after a closing quote; remove it, or double the quotes within a cell"
        raise UnusableInput(f"{path}: row {number + 1} {why}") from None


def _uneven(path: Path, number: int, row: list[str], names: tuple[str, ...], header: int) -> UnusableInput:
    no_sample = len(row) < len(names) or not any(map(NUMBER.fullmatch, row))
    if number == header + 1 and no_sample:  # more text, or the names
        return UnusableInput(f"{path}: row {header} {NOT_THE_NAMES}")
    if len(row) < len(names):
        why = f"ends before column {short(names[len(row)])}; complete or delete the row"
    else:
        more = len(row) - len(names)
        cells = "one more cell" if more == 1 else f"{more} more cells"
        why = f"has {cells} after column {short(names[-1])}, which has no name; name it, or remove it"
    return UnusableInput(f"{path}: row {number} {why}")
