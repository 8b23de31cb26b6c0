"""What is known of a machine as a table [plant] of a dataset.toml, in SI units."""

from __future__ import annotations

import json

from simgap.data.formats.plant_table import STANDARD_GRAVITY, TICKS, TURN
from simgap.known_plant import Known, KnownPlant
from simgap.records import Channels


def plant_lines(plant: KnownPlant, channels: Channels) -> list[str]:
    """Write the table; `read_plant` makes the same of it on the same channels."""
    lines = ["", "[plant]"]
    if not plant.controlled:
        lines.append(f"input = {_quoted(plant.input)}")
    for key in ("mass", "arm", "inertia", "damping", "supply"):
        known: Known | None = getattr(plant, key)
        if known is not None:
            of_tank = key == "inertia" and channels.outputs[0].kind == "level"
            lines.append(f"{'area' if of_tank else key} = {_constant(known)}")
    if plant.enabled:
        lines.append(f"enabled = {_quoted(plant.enabled)}")
    if plant.gravity:
        lines.append(f"gravity = {'true' if plant.gravity == STANDARD_GRAVITY else repr(plant.gravity)}")
    if plant.hangs_at:
        lines.append(f"hangs_at = {plant.hangs_at!r}")
    goal = next(channel for channel in channels.inputs if channel.name == plant.input)
    if channels.outputs[0].unit in TICKS:
        lines.append(f"ticks_per_turn = {TURN / plant.radian!r}")
    elif goal.unit in TICKS and plant.controlled:
        lines.append(f"ticks_per_turn = {TURN / (plant.goal_factor * plant.radian)!r}")
    if plant.controlled:
        lines += ["", "[plant.controller]", f"goal = {_quoted(plant.input)}"]
        lines += [f"gain = {_constant(plant.gain)}"] if plant.gain is not None else []
        lines += [f"derivative = {_constant(plant.derivative)}"] if plant.derivative is not None else []
    return lines


def _constant(known: Known) -> str:
    if known.column:
        return _quoted(known.column)
    if known.certain:
        return repr(known.value)
    return f"{{ value = {known.value!r}, low = {known.low!r}, high = {known.high!r} }}"


def _quoted(text: str) -> str:
    """Write a TOML basic string; JSON escapes the same way."""
    return json.dumps(text, ensure_ascii=False)
