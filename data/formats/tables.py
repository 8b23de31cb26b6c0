"""A table of numbers that can point at each of its cells."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from reprlib import repr as short
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.data.formats.headings import Heading, find, heading_of, listed
from simgap.data.formats.layout import Layout
from simgap.records import LARGEST_VALUE, Experiment, UnusableInput


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
    header_row: int | None = None
    layout: Layout = field(default_factory=Layout)

    def __len__(self) -> int:
        return len(self.cells[0]) if self.cells else 0

    def refuse(self, index: int, column: str, why: str) -> UnusableInput:
        """Make the error that names the source, the row of sample `index` and the column."""
        return UnusableInput(f"{self.source}: row {index + self.first_row}, column {short(column)}: {why}")

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
            raise self.refuse(bad.index, column, bad.why) from None
        wrong = np.flatnonzero(~(np.abs(values) <= LARGEST_VALUE))
        if wrong.size:
            why = f"{values[wrong[0]]} is no measurement; correct it or end the record at the row before"
            raise self.refuse(int(wrong[0]), column, why)
        return values

    def experiment(self, name: str, inputs: Sequence[str], outputs: Sequence[str], dt: float) -> Experiment:
        """Make one experiment, sampled every dt seconds, of the input and output columns."""
        u = np.column_stack([self.numbers(column) for column in inputs])  # [T, nu]
        y = np.column_stack([self.numbers(column) for column in outputs])  # [T, ny]
        return Experiment(name, u, y, dt)
