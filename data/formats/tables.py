"""A table of numbers that can point at each of its cells, and the strict CSV reader that makes one."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from reprlib import repr as short
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.records import LARGEST_VALUE, UnusableInput

# What a decimal number is made of. float() alone would also take 1_000, nan, inf and foreign digits.
NUMBER_CHARACTERS = frozenset("0123456789+-.eE ")


class BadCell(Exception):
    """Cell number `index` of a column is no number; `why` says what it is and what to do."""

    def __init__(self, index: int, why: str) -> None:
        super().__init__(index, why)
        self.index, self.why = index, why


@dataclass(frozen=True, eq=False)
class Table:
    """Named columns of equal length, and how to name their rows to the person who owns them."""

    source: str
    names: tuple[str, ...]
    cells: tuple[Any, ...]
    first_row: int
    parse: Callable[[Any], np.ndarray]

    def __len__(self) -> int:
        return len(self.cells[0]) if self.cells else 0

    def refuse(self, index: int, column: str, why: str) -> UnusableInput:
        """The error that names the source, the row of sample `index` and the column."""
        return UnusableInput(f"{self.source}: row {index + self.first_row}, column {short(column)}: {why}")

    def cells_of(self, column: str) -> Any:
        """The column as it came. Raises UnusableInput when it is missing or doubled."""
        found = self.names.count(column)
        if found == 1:
            return self.cells[self.names.index(column)]
        header = f"{self.source}: row {self.first_row - 1}" if self.first_row else self.source
        if found:
            why = f"names column {short(column)} {found} times; rename or remove all but one"
        else:
            why = f"has no column {short(column)}; it has {short(list(self.names))}; correct one of them"
        raise UnusableInput(f"{header} {why}")

    def numbers(self, column: str) -> Float[np.ndarray, " T"]:
        """The column as float64. Raises UnusableInput when it is missing, doubled or holds a bad cell."""
        try:
            values = self.parse(self.cells_of(column))
        except BadCell as bad:
            raise self.refuse(bad.index, column, bad.why) from None
        wrong = np.flatnonzero(~(np.abs(values) <= LARGEST_VALUE))
        if wrong.size:
            why = f"{values[wrong[0]]} is no measurement; correct it or cut the record before it"
            raise self.refuse(int(wrong[0]), column, why)
        return values


def read_csv(path: Path) -> Table:
    """The CSV file as a table; rows are named by line, the header is line 1.

    Raises UnusableInput for anything but UTF-8 text with commas, one header line and one line per sample.
    """
    rows = _rows(path, _text(path))
    names = tuple(name.strip() for name in next(rows, []))
    if not names:
        raise UnusableInput(f"{path}: row 1 is empty; it must name the columns")
    if len(names) == 1 and any(mark in names[0] for mark in ";\t|"):
        mark = next(mark for mark in ";\t|" if mark in names[0])
        raise UnusableInput(f"{path}: row 1 is separated by {mark!r}; save the file with commas instead")
    columns: list[list[str]] = [[] for _ in names]
    blank = 0
    for number, row in enumerate(rows, start=2):
        if not row:  # the line break at the end of a file is no sample
            blank = blank or number
        elif blank:
            raise UnusableInput(f"{path}: row {blank} is empty; delete it or fill in the sample")
        elif len(row) != len(names):
            raise _uneven(path, number, row, names)
        else:
            for cells, cell in zip(columns, row, strict=True):
                cells.append(cell)
    if not columns[0]:
        raise UnusableInput(f"{path}: nothing follows row 1, the names of the columns; add the samples")
    return Table(str(path), names, tuple(columns), first_row=2, parse=parse_text)


def parse_text(cells: Sequence[str]) -> Float[np.ndarray, " T"]:
    """Cells of text as float64. Raises BadCell at the first that is not a plain decimal number."""
    if NUMBER_CHARACTERS.issuperset("".join(cells)):
        try:
            return np.array(list(map(float, cells)), dtype=np.float64)
        except ValueError:
            pass  # the search below finds the cell
    for index, cell in enumerate(cells):
        _check_cell(index, cell)
    raise AssertionError("one of the cells is bad, or the fast way above had succeeded")


def _check_cell(index: int, cell: str) -> None:
    if not cell.strip():
        raise BadCell(index, "the cell is empty; fill it in or cut the record before it")
    if cell.strip().lower().lstrip("+-") in ("nan", "inf", "infinity", "na", "n/a", "null", "none"):
        raise BadCell(index, f"{short(cell)} is no measurement; correct it or cut the record before it")
    try:
        float(cell)
        plain = NUMBER_CHARACTERS.issuperset(cell)
    except ValueError:
        plain = False
    if not plain:
        raise BadCell(index, f"{short(cell)} is not a number; write it like -1.25 or 3e-4")


def _text(path: Path) -> str:
    try:
        if not path.is_file():  # a pipe would never end
            raise UnusableInput(f"{path} is missing or no ordinary file; give a CSV file")
        content = path.read_bytes()
    except OSError as error:
        raise UnusableInput(f"{path} cannot be read ({error.strerror}); check its permissions") from error
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        row = content.count(b"\n", 0, error.start) + 1
        raise UnusableInput(
            f"{path}: row {row} is not UTF-8 text; save the file as CSV in the encoding UTF-8"
        ) from None
    if "\0" in text:
        row = text.count("\n", 0, text.index("\0")) + 1
        raise UnusableInput(f"{path}: row {row} holds a NUL byte, so this is no text; save the file as CSV")
    if not text.strip():
        raise UnusableInput(f"{path} is empty; give it a line of column names and a line per sample")
    return text


def _rows(path: Path, text: str) -> Iterator[list[str]]:
    """The rows as cells, each checked to be one line, so that row i is line i of the file."""
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    number = 0
    try:
        for number, row in enumerate(reader, start=1):
            if reader.line_num != number:
                raise UnusableInput(
                    f"{path}: row {number}: a cell in quotes runs over several lines; keep each sample on one line"
                )
            yield row
    except csv.Error as error:
        why = f"row {number + 1} is no CSV: {error}; keep each sample on one line, cells apart by commas"
        raise UnusableInput(f"{path}: {why}") from None


def _uneven(path: Path, number: int, row: list[str], names: tuple[str, ...]) -> UnusableInput:
    if len(row) < len(names):
        why = f"ends before column {short(names[len(row)])}; complete or delete the row"
    else:
        why = f"has {len(row) - len(names)} more cells after column {short(names[-1])}; remove them"
    return UnusableInput(f"{path}: row {number} {why}")
