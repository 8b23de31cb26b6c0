"""What kind of motion an output is: read off its name and unit where they leave no doubt, or said by the user."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from reprlib import repr as short
from typing import get_args

from simgap.data.formats.headings import find, heading_of, listed
from simgap.records import Channels, Dataset, Kind, UnusableInput
from simgap.units import Quantity, plain, quantity

KINDS = get_args(Kind)

WORDS: dict[str, frozenset[str]] = {
    "velocity": frozenset({"speed", "velocity", "vel", "rpm", "geschwindigkeit", "drehzahl"}),
    "position": frozenset({"position", "pos", "angle", "displacement", "winkel"}),
    "level": frozenset({"level", "tank", "füllstand", "niveau"}),
    "other": frozenset({
        "temperature", "temp", "voltage", "current", "pressure", "force", "torque", "power", "humidity", "acceleration",
        "accel", "temperatur", "spannung", "strom", "druck", "kraft",
    }),
}  # fmt: skip
# A height may be that of a lift or of water in a tank, and a rate the derivative of whatever stands before it.
UNSURE = frozenset({"height", "h", "depth", "rate", "error"})
LIQUIDS = WORDS["level"] | {"water", "liquid", "fluid", "oil", "fuel", "upper", "lower", "left", "right", "in", "of"}


def kind_of(name: str, unit: str) -> Kind | None:
    """Tell the kind of an output by its name and unit; None where they are silent, unsure or contradict each other."""
    words = _words(name)
    measured = quantity(unit) if unit else None
    by_name, by_unit = _by_name(words), _by_unit(measured)
    if by_name == "level":
        return "level" if _may_be_a_level(words, measured, unit) else None
    if words & UNSURE and by_unit in ("position", None):
        return None
    if measured and measured.angle and re.fullmatch(r"[Tt]\d*", name):
        return None  # degrees of heat or of an angle
    if by_name and by_unit and by_name != by_unit:
        return None
    return by_unit or by_name


def _words(name: str) -> frozenset[str]:
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    return frozenset(re.findall(r"[^\W\d_]+", apart.casefold()))


def _by_name(words: frozenset[str]) -> Kind | None:
    found: list[Kind] = [kind for kind in ("position", "velocity", "level", "other") if words & WORDS[kind]]
    return found[0] if len(found) == 1 else None


def _by_unit(measured: Quantity | None) -> Kind | None:
    if measured is None or measured.label:
        return None
    way, time = measured.angle + measured.length, measured.time
    if measured.other:
        return "other"
    if way == 1 and 0 in (measured.angle, measured.length) and time in (0, -1):
        return "velocity" if time else "position"
    return "other" if way and (way > 1 or time < -1) else None


def _may_be_a_level(words: frozenset[str], measured: Quantity | None, unit: str) -> bool:
    if measured is None or measured.label:
        return not unit and "tank" not in words and words <= LIQUIDS
    volume = measured in (Quantity(length=3), Quantity(length=1)) or plain(unit) in ("l", "L", "ml", "%")
    return volume and (words <= LIQUIDS or plain(unit) != "%")


def with_kinds(dataset: Dataset, kind: str | Mapping[str, str] | None) -> Dataset:
    """Say what outputs of a data set are: one kind for a single output, or kinds by name; they win over any other.

    Raises UnusableInput for an unknown output or kind, and for one kind where there are several outputs.
    """
    if kind is None:
        return dataset
    outputs = list(dataset.channels.outputs)
    names = [channel.name for channel in outputs]
    if isinstance(kind, str):
        if len(outputs) > 1:
            raise UnusableInput(f"{dataset.name}: kind {short(kind)} of which output? There are {listed(names)}; "
                                f"write --kind NAME={kind} ({{NAME: {kind!r}}} in Python)")  # fmt: skip
        kind = {names[0]: kind}
    for name, one in kind.items():
        found = find(names, name) or find(names, heading_of(name).name)
        if len(found) != 1:
            raise UnusableInput(f"{dataset.name}: kind of {short(name)}: there are the outputs {listed(names)}")
        if one not in KINDS:
            raise UnusableInput(f"{dataset.name}: {short(name)} cannot be {short(one)}; use one of {', '.join(KINDS)}")
        outputs[found[0]] = replace(outputs[found[0]], kind=one, kind_from="option")
    return dataset.with_channels(replace(dataset.channels, outputs=tuple(outputs)))


def told(channels: Channels) -> tuple[str, ...]:
    """Say in words which kinds were read off names and units."""
    read = [channel for channel in channels.outputs if channel.kind_from == "header"]
    return tuple(
        f"{channel.name} as {channel.kind} ({f'{channel.unit}, by name and unit' if channel.unit else 'by name'})"
        for channel in read
    )
