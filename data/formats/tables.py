"""A table of numbers that can point at each of its cells."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from reprlib import repr as short
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from simgap.data.formats.headings import Heading, find, heading_of, listed
from simgap.data.formats.layout import Layout
from simgap.records import LARGEST_VALUE, Experiment, UnusableInput

NO_VALUE = frozenset({"", "nan", "na", "n/a", "#n/a", "null", "none"})
CORRECT = "correct it or end the record at the row before"
FILL_IN = "fill it in or end the record at the row before"


class BadCell(Exception):
    """Cell number `index` of a column is no number; `why` says what it is and, unless it is missing, what to do."""

    def __init__(self, index: int, why: str, missing: bool = False) -> None:
        super().__init__(index, why)
        self.index, self.why, self.missing = index, why, missing


def is_missing(cell: str) -> bool:
    """Tell whether a cell of text is empty or says that there is no value."""
    return cell.strip().lower().lstrip("+-") in NO_VALUE


def missing_in(cells: Any) -> Bool[np.ndarray, " T"]:
    """Tell which cells of a column are missing, of text, numbers or a Series."""
    if hasattr(cells, "isna"):
        return cells.isna().to_numpy()
    if isinstance(cells, np.ndarray):
        return np.isnan(cells)
    return np.fromiter(map(is_missing, cells), bool, len(cells))


@dataclass(frozen=True, eq=False)
class Table:
    """Named columns of equal length, and how to name their rows to the person who owns them.

    `rows` counts the rows that are left where some were left out, `if_missing` is the remedy for a missing cell.
    """

    source: str
    names: tuple[str, ...]
    cells: tuple[Any, ...]
    first_row: int
    parse: Callable[[Any], np.ndarray]
    header_row: int | None = None
    layout: Layout = field(default_factory=Layout)
    rows: Int[np.ndarray, " T"] | None = None
    if_missing: str = FILL_IN

    def __len__(self) -> int:
        return len(self.cells[0]) if self.cells else 0

    def refuse(self, index: int, column: str, why: str) -> UnusableInput:
        """Make the error that names the source, the row of sample `index` and the column."""
        row = self.first_row + int(index if self.rows is None else self.rows[index])
        return UnusableInput(f"{self.source}: row {row}, column {short(column)}: {why}")

    def refuse_cell(self, bad: BadCell, column: str) -> UnusableInput:
        """Make the error about a bad cell of a column."""
        return self.refuse(bad.index, column, f"{bad.why}; {self.if_missing}" if bad.missing else bad.why)

    def only(self, rows: slice | Int[np.ndarray, " N"]) -> Table:
        """Keep these rows; they keep their numbers in the file."""
        every = np.arange(len(self)) if self.rows is None else self.rows
        return replace(self, cells=tuple(_chosen(column, rows) for column in self.cells), rows=every[rows])

    def index(self, column: str) -> int:
        """Find a column by its heading, or by the name in it. Raises UnusableInput when it is missing or doubled."""
        found = find(self.names, column)
        if len(found) == 1:
            return found[0]
        header = f"{self.source}: row {self.header_row}" if self.header_row else self.source
        if not found:
            there = listed(self.names)
            raise UnusableInput(f"{header} has no column {short(column)}; there are {there}; name one of them")
        if len({self.names[i] for i in found}) == 1:
            raise UnusableInput(
                f"{header} names column {short(column)} {len(found)} times; rename or remove all but one"
            )
        there = listed([self.names[i] for i in found])
        raise UnusableInput(f"{header}: column {short(column)} may be {there}; write one of them in full")

    def cells_of(self, column: str) -> Any:
        """Give a column as it came. Raises UnusableInput when it is missing or doubled."""
        return self.cells[self.index(column)]

    def heading(self, column: str) -> Heading:
        """Give the name and the unit of a column; where its heading says no unit, a line of units below may."""
        i = self.index(column)
        heading = heading_of(self.names[i])
        return Heading(heading.name, heading.unit or (self.layout.units[i] if self.layout.units else ""))

    def numbers(self, column: str) -> Float[np.ndarray, " T"]:
        """Give a column as float64. Raises UnusableInput when it is missing, doubled or holds a bad cell."""
        try:
            values = self.parse(self.cells_of(column))
        except BadCell as bad:
            raise self.refuse_cell(bad, column) from None
        wrong = np.flatnonzero(~(np.abs(values) <= LARGEST_VALUE))
        if wrong.size:
            value = values[wrong[0]]
            why = f"{value} is no measurement" + ("" if np.isnan(value) else f"; {CORRECT}")
            raise self.refuse_cell(BadCell(int(wrong[0]), why, missing=bool(np.isnan(value))), column)
        return values

    def experiment(self, name: str, inputs: Sequence[str], outputs: Sequence[str], dt: float) -> Experiment:
        """Make one experiment, sampled every dt seconds, of the input and output columns."""
        u = np.column_stack([self.numbers(column) for column in inputs])  # [T, nu]
        y = np.column_stack([self.numbers(column) for column in outputs])  # [T, ny]
        return Experiment(name, u, y, dt)


def _chosen(column: Any, rows: slice | Int[np.ndarray, " N"]) -> Any:
    if isinstance(column, list | tuple) and not isinstance(rows, slice):
        return [column[i] for i in rows]
    return getattr(column, "iloc", column)[rows]
