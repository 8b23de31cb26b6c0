"""A table of one record as a data set: its columns, its sampling time, its pieces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from simgap.data.formats.clock import Clock, read_clock, time_column
from simgap.data.formats.description import check_columns
from simgap.data.formats.gaps import SHORTEST_PIECE, pieces_of
from simgap.data.formats.headings import heading_of, listed, time_unit
from simgap.data.formats.sampling import check_clock, check_coarse, is_coarse, sampling_time
from simgap.data.formats.tables import Table, missing_in
from simgap.data.kinds import kind_of
from simgap.data.splits import assemble, split_in_time, split_pieces
from simgap.records import LARGEST_VALUE, Channel, Channels, Dataset, Experiment, UnusableInput

BEGIN_ANEW = "fill it in, or --split-gaps begins a new experiment after it (split_gaps=True in Python)"
SEPARATED = {",": "", ";": "semicolons between cells", "\t": "tabs between cells"}


@dataclass(frozen=True)
class Choices:
    """What a user may say about a file: columns, sampling time in s, name, and what to do about uneven time."""

    inputs: Sequence[str] = ()
    outputs: Sequence[str] = ()
    dt: float | None = None
    name: str | None = None
    resample: float | None = None
    split_gaps: bool = False


@dataclass(frozen=True, eq=False)
class OneRecord:
    """A record: in one piece or in several, its channels, and in words what was inferred of it."""

    source: str
    pieces: tuple[Experiment, ...]
    channels: Channels
    said: tuple[str, ...]


def dataset_of(record: OneRecord, name: str) -> Dataset:
    """Split a record in time. Raises UnusableInput."""
    splits = split_in_time(record.pieces[0]) if len(record.pieces) == 1 else split_pieces(record.pieces)
    return assemble(name, splits, record.channels, None, record.source)


def record_of(table: Table, choices: Choices) -> OneRecord:
    """Read the chosen columns of a table, and its sampling time. Raises UnusableInput."""
    _check(table, choices)
    check_columns((*choices.inputs, *choices.outputs), table.source)
    # A misspelt column is a better answer than a missing sampling time.
    columns = [table.index(column) for column in (*choices.inputs, *choices.outputs)]
    inputs = [table.names[i] for i in columns[: len(choices.inputs)]]
    outputs = [table.names[i] for i in columns[len(choices.inputs) :]]
    check_columns((*inputs, *outputs), table.source)
    channels = _channels(table, inputs, outputs)
    time = time_column(table, set(columns))
    whole = table if choices.split_gaps else replace(table, if_missing=BEGIN_ANEW)
    table = _without_missing(whole, [*inputs, *outputs, *([time] if time else [])]) if choices.split_gaps else whole
    clock, ignored = _clock_of(table, time, choices.dt)
    used = _clock_of_rows(table, choices.dt) if clock is None and choices.dt and choices.split_gaps else clock
    if used is not None and (choices.resample is not None or choices.split_gaps):
        left_out = len(whole) - len(table)
        pieces, said = pieces_of(
            table, used, inputs, outputs, choices.dt, choices.resample, choices.split_gaps, left_out
        )
    else:
        step = _sampling_time(table, clock, choices)
        pieces, said = (table.experiment("record", inputs, outputs, step),), ()
    said = _told(table, clock, channels, pieces[0].dt, choices, (*ignored, *said))
    return OneRecord(table.source, tuple(pieces), channels, said)


def _without_missing(table: Table, columns: Sequence[str]) -> Table:
    """Leave out the rows in which one of these columns has no value, unless next to nothing would be left."""
    missing = np.logical_or.reduce([missing_in(table.cells_of(column)) for column in columns])
    enough = len(table) - np.sum(missing) >= SHORTEST_PIECE
    return table.only(np.flatnonzero(~missing)) if missing.any() and enough else table


def _clock_of(table: Table, time: str | None, dt: float | None) -> tuple[Clock | None, tuple[str, ...]]:
    """Read the time column; with a given sampling time a clock that is too coarse for it is ignored, in words."""
    if time is None:
        return None, ()
    clock = read_clock(table, time)
    if dt is None or not is_coarse(clock):
        return clock, ()
    check_coarse(clock, dt)
    return None, (f"column {table.heading(time).name} ignored, a clock too coarse for steps of {dt:g} s",)


def _clock_of_rows(table: Table, dt: float) -> Clock:
    """Take the time of each row from its place in the file."""
    return Clock(table, "", dt * (np.arange(len(table)) if table.rows is None else table.rows))


def _check(table: Table, choices: Choices) -> None:
    for column_list, role in ((choices.inputs, "inputs"), (choices.outputs, "outputs")):
        if isinstance(column_list, str) or not column_list:
            raise UnusableInput(
                f"{table.source}: say which columns are the {role} (--{role[:-1]} NAME, or {role}=[..] in Python); "
                f"there are {listed(table.names)}{_example(table)}"
            )
    for option, seconds in (("dt", choices.dt), ("resample", choices.resample)):
        if seconds is not None and not 0 < seconds <= LARGEST_VALUE:
            raise UnusableInput(
                f"{table.source}: {option} = {seconds} must be a positive number of seconds, such as 0.1"
            )
    if choices.dt is not None and choices.resample is not None:
        raise UnusableInput(f"{table.source}: the sampling time is that of resample; leave out dt")


def _example(table: Table) -> str:
    """Write out the options of a table with two columns beside the time."""
    rest = [heading_of(name).name for name in table.names if time_unit(name) is None]
    if len(rest) != 2:
        return ""
    one, other = (f'"{name}"' if " " in name else name for name in rest)
    return f"; if {one} drives {other}, write --input {one} --output {other}, else the other way round"


def _channels(table: Table, inputs: Sequence[str], outputs: Sequence[str]) -> Channels:
    """Name the channels without their units, but where two would then share a name."""
    names = [table.heading(column).name for column in (*inputs, *outputs)]
    made = []
    for column in (*inputs, *outputs):
        heading = table.heading(column)
        name = heading.name if names.count(heading.name) == 1 else column
        kind = kind_of(heading.name, heading.unit)
        made.append(Channel(name, heading.unit, kind, "header") if kind else Channel(name, heading.unit))
    return Channels(tuple(made[: len(inputs)]), tuple(made[len(inputs) :]))


def _sampling_time(table: Table, clock: Clock | None, choices: Choices) -> float:
    taken = [name for name in (*choices.inputs, *choices.outputs) if clock is None and time_unit(name) is not None]
    if taken and choices.dt is None:
        raise UnusableInput(f"{table.source}: {taken[0]!r} is the time, and cannot be an input or output beside; "
                            "leave it out of them, or give the sampling time (--dt)")  # fmt: skip
    if clock is None and (choices.resample is not None or choices.split_gaps):
        raise UnusableInput(f"{table.source}: without a time column there are no gaps and nothing to resample; "
                            f"call it 't' or 'time'")  # fmt: skip
    if choices.dt is None and clock is None:
        raise UnusableInput(
            f"{table.source}: the sampling time is not known; give it in seconds (--dt 0.01, or dt=0.01 in "
            f"Python), or call the column of the time 't' or 'time'"
        )
    if choices.dt is None:
        assert clock is not None
        return sampling_time(clock)
    if clock is not None:
        check_clock(clock, choices.dt)
    return float(choices.dt)


def _told(
    table: Table, clock: Clock | None, channels: Channels, dt: float, choices: Choices, said: tuple[str, ...]
) -> tuple[str, ...]:
    """Say what was inferred of the file and its time; nothing of a plain file with a column t or time in seconds.

    Times without a unit that are a second or more apart may as well count milliseconds or samples, so that is said.
    """
    layout = table.layout
    about = [SEPARATED[layout.separator]] if layout.separator != "," else []
    about += ["decimal commas"] if layout.decimal == "," else []
    about += [f"the header from the comment in row {table.header_row}"] if layout.header_is_comment else []
    about += [f"units from row {table.first_row - 1}"] if layout.units else []
    units = any(channel.unit for channel in (*channels.inputs, *channels.outputs))
    units |= any(channel.kind_from == "header" for channel in channels.outputs)
    heading_unit = "" if clock is None else table.heading(clock.column).unit or time_unit(clock.column)
    slow = clock is not None and dt >= 1 and not clock.counts and not heading_unit
    if clock is not None and (about or said or units or clock.counts or slow or clock.column not in ("t", "time")):
        counts = f", which {'holds' if clock.is_dated else 'counts'} {clock.counts}" if clock.counts else ""
        counts = (
            f", taken for seconds because its heading says no unit, such as '{clock.column} [ms]'" if slow else counts
        )
        what = "time" if choices.resample else f"sampling time {dt:g} s"
        about.append(f"{what} from column {table.heading(clock.column).name}{counts}")
    return (*about, *said)
