"""A table of numbers that can point at each of its cells."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from reprlib import repr as short
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.records import LARGEST_VALUE, Channels, Experiment, UnusableInput


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
        """Make the error that names the source, the row of sample `index` and the column."""
        return UnusableInput(f"{self.source}: row {index + self.first_row}, column {short(column)}: {why}")

    def cells_of(self, column: str) -> Any:
        """Give a column as it came. Raises UnusableInput when it is missing or doubled."""
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
        """Give a column as float64. Raises UnusableInput when it is missing, doubled or holds a bad cell."""
        try:
            values = self.parse(self.cells_of(column))
        except BadCell as bad:
            raise self.refuse(bad.index, column, bad.why) from None
        wrong = np.flatnonzero(~(np.abs(values) <= LARGEST_VALUE))
        if wrong.size:
            why = f"{values[wrong[0]]} is no measurement; correct it or cut the record before it"
            raise self.refuse(int(wrong[0]), column, why)
        return values

    def experiment(self, name: str, channels: Channels, dt: float) -> Experiment:
        """Make one experiment, sampled every dt seconds, of the input and output columns."""
        u = np.column_stack([self.numbers(channel.name) for channel in channels.inputs])  # [T, nu]
        y = np.column_stack([self.numbers(channel.name) for channel in channels.outputs])  # [T, ny]
        return Experiment(name, u, y, dt)
