"""The time column in seconds, whatever it counts: seconds, other units, seconds since 1970, dates or times of day."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, time, timedelta
from reprlib import repr as short
from typing import Any

import numpy as np
from jaxtyping import Float, Int64

from simgap.data.formats.headings import time_unit
from simgap.data.formats.tables import BadCell, Table, is_missing
from simgap.records import UnusableInput
from simgap.units import seconds_in

DATE = re.compile(r"\s*\d{1,4}[-./:]\d{1,2}[-./:]\d|\s*\d{1,2}:\d\d")
YEAR_FIRST = re.compile(r"(\d{4})/(\d\d)/(\d\d)")
DAY_FIRST = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})")
TIME_OF_DAY = re.compile(r"\s*\d{1,2}:\d\d:")
DATES, TIMES_OF_DAY = "dates", "times of day"
MICROSECOND = timedelta(microseconds=1)
DAY = timedelta(days=1) // MICROSECOND
# Numbers without a unit that lie within the years 2000 to 2100 when they count milliseconds since 1970: no record in
# seconds gets there.
EPOCH = (946_684_800, 4_102_444_800)
DAYS = ((36_526, 73_051), (730_486, 767_011))  # the same years in days of Excel, and of MATLAB's datenum


@dataclass(frozen=True, eq=False)
class Clock:
    """The times of a table's rows in seconds, the column that they come from, and what it counts if not seconds."""

    table: Table
    column: str
    seconds: Float[np.ndarray, " T"]
    counts: str = ""

    @property
    def is_dated(self) -> bool:
        """Tell whether the column holds dates or times of day."""
        return self.counts in (DATES, TIMES_OF_DAY)

    @property
    def unit(self) -> str:
        """What stands behind a time that is shown."""
        return "" if self.is_dated else " s"

    def shown(self, index: int) -> str:
        """Write the time of a row for a message: dates as they stand there, numbers in seconds."""
        if self.is_dated:
            cells = self.table.cells_of(self.column)
            return str(getattr(cells, "iloc", cells)[index]).strip()
        return f"{self.seconds[index]:.9g}"

    @property
    def resolution(self) -> float:
        """Rounding of the last time stamp to float64, in seconds."""
        return float(np.spacing(np.abs(self.seconds).max()))


def read_clock(table: Table, column: str) -> Clock:
    """Read a time column. Raises UnusableInput for a cell that is no time."""
    cells = table.cells_of(column)
    column = table.names[table.index(column)]
    kind = getattr(getattr(cells, "dtype", None), "kind", "")
    try:
        if kind == "M":  # dates of pandas
            return Clock(table, column, _since_first(_whole_microseconds(cells)), DATES)
        texts = list(cells) if kind in ("", "O", "T") else []
        if texts and isinstance(texts[0], str) and DATE.match(texts[0]):
            holds = TIMES_OF_DAY if TIME_OF_DAY.match(texts[0]) else DATES
            return Clock(table, column, _since_first(_stamps(texts)), holds)
        if texts and isinstance(texts[0], datetime):
            return Clock(table, column, _since_first(_stamps(list(map(str, texts)))), DATES)
    except BadCell as bad:
        raise table.refuse_cell(bad, column) from None
    return _counted(table, column, table.numbers(column))


def _counted(table: Table, column: str, t: Float[np.ndarray, " T"]) -> Clock:
    heading = table.heading(column)
    unit = time_unit(column, heading.unit)
    unit = heading.unit if unit is None and seconds_in(heading.unit) else unit
    if not unit and t.size and EPOCH[0] <= t[0] / 1000 <= EPOCH[1]:
        return Clock(table, column, (t - t[0]) / 1000, "milliseconds since 1970")
    if not unit and t.size and abs(t[0]) >= EPOCH[0] * 1000:
        why = f"{t[0]:.6g} s is no time of a record; write the unit into the heading, such as 'time [us]'"
        raise table.refuse(0, column, why)
    if not unit and t.size > 1 and any(low < t[0] < high for low, high in DAYS) and np.median(np.diff(t)) < 1e-3:
        why = f"{t[0]:.9g} may count days, as Excel and MATLAB do, or seconds; write the unit into the heading"
        raise table.refuse(0, column, f"{why}, such as 'time [d]' or 'time [s]'")
    times, parts = seconds_in(unit or "s") or (1, 1)
    if (times, parts) == (1, 1) and unit and t.size and abs(t[0]) > EPOCH[1]:
        raise table.refuse(0, column, f"{t[0]:.6g} s is no time of a record; correct the unit in the heading")
    if (times, parts) == (1, 1):
        return Clock(table, column, t)
    return Clock(table, column, t * times / parts, unit or "")


def _whole_microseconds(cells: Any) -> Int64[np.ndarray, " T"]:
    missing = np.flatnonzero(cells.isna().to_numpy())
    if missing.size:
        raise BadCell(int(missing[0]), "the time is missing", missing=True)
    naive = cells.dt.tz_convert("UTC").dt.tz_localize(None) if cells.dt.tz is not None else cells
    return naive.to_numpy().astype("datetime64[us]").astype(np.int64)


def _since_first(microseconds: Int64[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
    return (microseconds - microseconds[0]) / 1e6


def _stamps(cells: Sequence[str]) -> Int64[np.ndarray, " T"]:
    """Read dates in microseconds, with or without a time zone, or times of day."""
    try:
        stamps = list(map(datetime.fromisoformat, cells))
        return np.fromiter(((stamp - stamps[0]) // MICROSECOND for stamp in stamps), np.int64, len(stamps))
    except (ValueError, TypeError):
        pass  # the slower way finds the cell
    stamps = [_stamp(index, cell) for index, cell in enumerate(cells)]
    for index, stamp in enumerate(stamps):
        if (stamp.tzinfo is None) != (stamps[0].tzinfo is None):
            raise BadCell(index, "some times have a time zone and some have none; write all alike")
    since = np.array([(stamp - stamps[0]) // MICROSECOND for stamp in stamps], dtype=np.int64)
    if TIME_OF_DAY.match(cells[0]):
        since += np.concatenate(([0], np.cumsum(np.diff(since) < -DAY // 2))) * DAY  # a night that was recorded through
    return since


def _stamp(index: int, cell: str) -> datetime:
    if is_missing(cell):
        raise BadCell(index, "the time is missing", missing=True)
    text = DAY_FIRST.sub(lambda day: f"{day[3]}-{int(day[2]):02d}-{int(day[1]):02d}", cell.strip())
    text = YEAR_FIRST.sub(r"\1-\2-\3", text)
    try:
        if TIME_OF_DAY.match(text):
            return datetime.combine(datetime(2000, 1, 1), time.fromisoformat(text.zfill(len(text) + (text[1] == ":"))))
        return datetime.fromisoformat(text)
    except ValueError:
        example = "write it like 2024-05-01 12:00:00.010"
        if re.match(r"\d{1,2}/\d{1,2}/", text):
            raise BadCell(index, f"{short(cell)} may name the day or the month first; {example}") from None
        raise BadCell(index, f"{short(cell)} is no date and time; {example}") from None


def time_column(table: Table, used: set[int]) -> str | None:
    """Find the heading of the time column among those that are no input or output. Raises UnusableInput for two."""
    free = [name for i, name in enumerate(table.names) if i not in used]
    times = [name for name in free if name in ("t", "time")]
    times = times or [name for name in free if time_unit(name, _unit_below(table, name)) is not None]
    if len(times) > 1:
        raise UnusableInput(
            f"{table.source}: columns {' and '.join(map(short, times[:3]))} look like the time; rename one"
        )
    return times[0] if times else None


def _unit_below(table: Table, name: str) -> str:
    return table.layout.units[table.names.index(name)] if table.layout.units else ""
