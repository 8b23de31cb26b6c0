"""A record as the page shows it, and as a data set with what a person said of it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from simgap.app.orders import Column, Curve, Look, Role, Settings
from simgap.data.formats.clock import Clock, read_clock, time_column
from simgap.data.formats.headings import find, heading_of, listed
from simgap.data.formats.logs import is_described
from simgap.data.formats.one_record import Choices
from simgap.data.formats.plant_table import parse_known, with_known
from simgap.data.formats.sampling import sampling_time
from simgap.data.formats.tables import Table, missing_in
from simgap.data.kinds import KINDS, kind_of, with_kinds
from simgap.data.loading import Reading, read, read_tables
from simgap.data.named import is_registered
from simgap.data.simulated_columns import split_off
from simgap.records import Channel, Dataset, UnusableInput
from simgap.reports.diagnosis.traces import thin

POINTS = 1500  # of a curve
MOST = 40  # columns that are shown
SIMULATED = {"sim", "simulated", "simulation"}


def look(source: str) -> Look:
    """Read what a data set, a folder or a file holds. Raises UnusableInput."""
    if is_registered(source) or is_described(Path(source)):
        return _of_dataset(read(source).dataset)
    return _of_logs(read_tables(source, Choices()))


def told(seen: Look, inputs: Sequence[str], outputs: Sequence[str], kinds: str | Mapping[str, str] | None) -> Settings:
    """Put headings for the names of columns, with or without the unit; what is not told is what the headings suggest.

    One kind is that of every output. Raises UnusableInput for an unknown column or kind.
    """
    headings = [column.heading for column in seen.columns]

    def heading(name: str) -> str:
        found = find(headings, name)
        if len(found) != 1:
            raise UnusableInput(f"column {name!r}: there are {listed(headings)}; name one of them")
        return headings[found[0]]

    named = {"input": list(map(heading, inputs)), "output": list(map(heading, outputs)), "simulated": []}
    rest = [column for column in seen.columns if column.heading not in (*named["input"], *named["output"])]
    role = {of: said or [column.heading for column in rest if column.role == of] for of, said in named.items()}
    if isinstance(kinds, str) and not role["output"]:
        raise UnusableInput(f"--kind {kinds}: name the output, with --output")
    of_outputs = dict.fromkeys(role["output"], kinds) if isinstance(kinds, str) else kinds or {}
    if unknown := sorted(set(of_outputs.values()) - set(KINDS)):
        raise UnusableInput(f"kind {unknown[0]!r}: use one of {', '.join(KINDS)}")
    kinds = {heading(name): kind for name, kind in of_outputs.items()}
    return Settings(role["input"], role["output"], role["simulated"], kinds=kinds)


def dataset_of(source: str, settings: Settings) -> Reading:
    """Read the data set that the settings describe, and somebody's simulation of it. Raises UnusableInput."""
    columns = settings.inputs, [*settings.outputs, *settings.simulated]
    reading = read(source, *columns, settings.dt, None, None, settings.resample, settings.split_gaps)
    dataset, theirs = with_units(reading.dataset, settings.units), None
    if settings.simulated:
        dataset, theirs = split_off(dataset, settings.simulated)
    dataset = with_kinds(dataset, settings.kinds or None)
    if theirs is not None:
        theirs = theirs.with_channels(replace(theirs.channels, outputs=dataset.channels.outputs))
    return Reading(with_known(dataset, parse_known(settings.known)), reading.said, theirs)


def with_units(dataset: Dataset, units: Mapping[str, str]) -> Dataset:
    """Say in which units columns are; what an output is, is read off its unit anew where nobody wrote it.

    Raises UnusableInput for an unknown column.
    """
    channels = dataset.channels
    every = [*channels.inputs, *channels.outputs]
    names = [channel.name for channel in every]
    for column, unit in units.items():
        found = find(names, column) or find(names, heading_of(column).name)
        if len(found) != 1:
            raise UnusableInput(f"{dataset.name}: unit of {column!r}: there are the columns {listed(names)}")
        every[found[0]] = _in_unit(every[found[0]], unit.strip(), is_output=found[0] >= len(channels.inputs))
    nu = len(channels.inputs)
    return dataset.with_channels(replace(channels, inputs=tuple(every[:nu]), outputs=tuple(every[nu:])))


def _in_unit(channel: Channel, unit: str, is_output: bool) -> Channel:
    if channel.unit == unit:
        return channel
    if not is_output or channel.kind_from not in ("header", "unknown"):
        return replace(channel, unit=unit)
    kind = kind_of(channel.name, unit)
    return Channel(channel.name, unit, kind, "header") if kind else Channel(channel.name, unit)


def _of_dataset(dataset: Dataset) -> Look:
    """Show the first test experiment of a data set that describes itself."""
    first, channels = dataset.test[0], dataset.channels
    every = [*dataset.training.train, *dataset.training.valid, *dataset.test]
    t = first.dt * np.arange(len(first))
    roles: tuple[tuple[Role, str, tuple[Channel, ...]], ...] = (
        ("input", "u", channels.inputs), ("output", "y", channels.outputs)
    )  # fmt: skip
    columns, curves = [], []
    for role, signal, of_role in roles:
        for i, channel in enumerate(of_role):
            values = [getattr(x, signal)[:, i] for x in every]
            low, high = min(float(v.min()) for v in values), max(float(v.max()) for v in values)
            kind = channel.kind if role == "output" and channel.kind_from != "unknown" else ""
            columns.append(Column(channel.name, channel.name, channel.unit, role, kind, low, high))
            curves.append(_curve(channel.name, t, getattr(first, signal)[:, i]))
    train, valid, test = map(len, (dataset.training.train, dataset.training.valid, dataset.test))
    about = f"{train} experiments to train, {valid} to validate, {test} to test; shown is {first.name}, to test on"
    samples = sum(map(len, every))
    return Look(samples, columns, curves, "time [s]", fixed=True, dt=first.dt, about=about)


def _of_logs(tables: Sequence[Table]) -> Look:
    """Show the first of several logs, or the only one."""
    table = tables[0]
    time = time_column(table, set())
    clock, dt, uneven = _time(table, time)
    t = np.arange(len(table), dtype=np.float64) if clock is None else clock.seconds - clock.seconds[0]
    columns, curves = [], []
    for i, heading in enumerate(table.names[:MOST]):
        if time is not None and i == table.index(time):
            continue
        try:
            column, there, values = _column(table, heading)
        except UnusableInput as problem:
            columns.append(Column(heading, heading, problem=str(problem)))
            continue
        columns.append(column)
        curves.append(_curve(heading, t[there], values))
    left_out = len(table.names) - MOST
    about = [f"{len(tables)} logs; shown is {Path(table.source).name}"] if len(tables) > 1 else []
    about += [f"{left_out} more columns are not shown"] if left_out > 0 else []
    x_title = "row" if clock is None else "time [s]"
    return Look(sum(map(len, tables)), columns, curves, x_title, False, time or "", dt, uneven, "; ".join(about))


def _time(table: Table, column: str | None) -> tuple[Clock | None, float | None, str]:
    """Read the times, the sampling time in s, and why there is none where it cannot be told."""
    clock = None
    try:
        if column is not None:
            clock = read_clock(table, column)
            return clock, sampling_time(clock), ""
    except UnusableInput as problem:
        return clock, None, str(problem)
    return None, None, ""


def _column(table: Table, heading: str) -> tuple[Column, np.ndarray, np.ndarray]:
    """Look at a column; with the rows in which there is a number, and these numbers."""
    cells, known = table.cells_of(heading), table.heading(heading)
    there = np.flatnonzero(~missing_in(cells))
    alone = replace(table, names=(heading,), cells=(cells,))
    values = (alone.only(there) if there.size else alone).numbers(heading)
    kind = kind_of(known.name, known.unit) or ""
    low, high = float(values.min()), float(values.max())
    return Column(heading, known.name, known.unit, _role(known.name, kind), kind, low, high), there, values


def _role(name: str, kind: str) -> Role:
    """Suggest what a column is, for somebody to look at before it counts."""
    words = set(re.findall(r"[^\W\d_]+", name.casefold()))
    if kind in ("position", "velocity", "level") or words == {"y"} or words & SIMULATED:
        return "simulated" if words & SIMULATED else "output"
    return "input" if words == {"u"} else ""


def _curve(heading: str, t: Sequence[float] | np.ndarray, values: np.ndarray) -> Curve:
    x, y = thin(np.asarray(t), values, POINTS)
    return Curve(heading, x.tolist(), y.tolist())
