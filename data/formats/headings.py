"""Column headings as people write them: a name and a unit, and which of them a person means."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from reprlib import repr as short

from simgap.units import quantity, seconds_in

BRACKETS = re.compile(r"(?P<name>.*?)(?P<gap>[\s_]*)(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*)\))")
SLASH = re.compile(r"(?P<name>.*\S)\s+/\s+(?P<unit>\S.*)")
MANY = 20  # columns that a message lists

TIME_NAMES = frozenset({
    "time", "timestamp", "time stamp", "datetime", "date time", "date/time", "elapsed time", "elapsed", "zeit",
    "zeitstempel", "uhrzeit", "seconds", "milliseconds", "millis", "microseconds", "micros",
})  # fmt: skip
TEMPERATURES = ("T_h", "T_s", "T_min", "T_d")  # hot, of the surface, the lowest, of the dew point
UNIT_IN_NAME = {"seconds": "s", "milliseconds": "ms", "millis": "ms", "microseconds": "us", "micros": "us"}


@dataclass(frozen=True)
class Heading:
    """The name and the unit in one column heading; the unit is empty where it says none."""

    name: str
    unit: str = ""


def heading_of(text: str) -> Heading:
    """Part 'Speed [rad/s]', 'T1 (degC)' or 'U / V' into name and unit; what is no unit stays in the name.

    After a blank, square brackets hold a unit whatever it is called, but no number: x [0] is a part of x.
    """
    if match := BRACKETS.fullmatch(text):
        unit = (match["square"] if match["square"] is not None else match["round"]).strip()
        named = match["square"] is not None and match["gap"] and re.search(r"[^\W\d]|%|°", unit)
        if match["name"] and (named or quantity(unit)) and not unit.isdigit():
            return Heading(match["name"], unit)
    if (match := SLASH.fullmatch(text)) and quantity(match["unit"]):
        return Heading(match["name"], match["unit"])
    return Heading(text)


def time_unit(text: str, unit: str = "") -> str | None:
    """Give the unit of a heading that names the time, empty where it says none; None for any other heading.

    t_ms, 'time, s' and the like count; a capital T is a time only with a unit of time, else a temperature.
    """
    heading = heading_of(text)
    name, unit = heading.name, heading.unit or unit
    if not unit and (match := re.fullmatch(r"(.+)(?:_|,\s*)([A-Za-z]+)", name)) and seconds_in(match[2].lower()):
        name, unit = match[1], match[2].lower() if text not in TEMPERATURES else ""
    small = name.casefold().replace("_", " ").strip()
    unit = unit or UNIT_IN_NAME.get(small, "")
    if unit and not seconds_in(unit):
        return None
    is_time = name == "t" or small in TIME_NAMES or (name == "T" and bool(unit))
    return unit if is_time else None


def find(columns: Sequence[str], wanted: str) -> list[int]:
    """Find the columns that a person may mean: by the whole heading, else by its name, else whatever the capitals."""
    names = [heading_of(column).name for column in columns]
    for these, text in (
        (columns, wanted),
        (names, wanted),
        ([column.casefold() for column in columns], wanted.casefold()),
        ([name.casefold() for name in names], wanted.casefold()),
    ):
        if found := [i for i, column in enumerate(these) if column == text]:
            return found
    return []


def listed(columns: Sequence[str]) -> str:
    """List columns in quotes for a message."""
    return ", ".join(map(short, columns[:MANY])) + (f" and {len(columns) - MANY} more" if len(columns) > MANY else "")
