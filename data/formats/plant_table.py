"""The table [plant] of a dataset.toml: what is known of the machine, with its units turned into SI."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from reprlib import repr as short
from typing import Any

import numpy as np

from simgap.known_plant import Known, KnownPlant
from simgap.records import Channels, Dataset, Experiment, UnusableInput
from simgap.units import TURN, of_motion

KEYS = ("input", "mass", "arm", "inertia", "area", "damping", "supply", "enabled", "gravity", "hangs_at",
        "ticks_per_turn", "controller")  # fmt: skip
CONTROLLER_KEYS = ("goal", "gain", "derivative")
INTERVAL_KEYS = ("value", "low", "high")
NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S.*?)?\s*")
IN_FILE, AS_OPTION = "[plant]", "--known"  # where a person wrote the table
MOVING = ("position", "velocity", "level")  # kinds of outputs that a machine moves
OF_A_BODY, OF_A_TANK = ("mass", "arm", "inertia", "gravity", "hangs_at", "ticks_per_turn"), ("area",)
STANDARD_GRAVITY = 9.80665
TICKS = ("tick", "ticks", "count", "counts")
FORCES = {"Nm": 1.0, "mNm": 1e-3, "N": 1.0, "mN": 1e-3}
# What a unit is worth in SI. A quantity without a unit is in SI already.
UNITS = {
    "mass": {"kg": 1.0, "g": 1e-3, "lb": 0.45359237},
    "arm": {unit: of_motion(unit).factor for unit in ("m", "cm", "mm", "in", "ft")},
    "inertia": {"kgm2": 1.0, "gm2": 1e-3, "kgcm2": 1e-4, "gcm2": 1e-7, "kg": 1.0, "g": 1e-3},
    "area": {"m2": 1.0, "cm2": 1e-4},
    "damping": {"Nms/rad": 1.0, "Nms": 1.0, "Ns/m": 1.0, "m2/s": 1.0},
    "supply": {"V": 1.0, "mV": 1e-3, "%": 1e-2, "duty": 1.0},
    "torque_constant": {f"{unit}{per}": size for per in ("", "/A", "/V") for unit, size in FORCES.items()},
    "gain": {},  # of a controller: its output per unit of the error, whatever these are
    "derivative": {},
}


def read_plant(table: Any, channels: Channels, where: str, called: str = IN_FILE) -> KnownPlant:
    """Read a table of what is known; `where`, and what it is called there, begin the sentence of an UnusableInput."""
    where = f"{where}: {called}"
    _check_table(table, KEYS, where)
    inputs, output = [channel.name for channel in channels.inputs], channels.outputs[0]
    if len(channels.outputs) != 1 or output.kind not in MOVING:
        remedy = f"give {short(output.name)} its kind, or leave the table out"
        if called == AS_OPTION:
            kind = f"{output.name}=velocity"
            kind = f'"{kind}"' if " " in kind else kind
            remedy = f"add --kind {kind}, or position or level (kind=.. in Python), or leave {called} out"
        if len(channels.outputs) != 1:
            remedy = f"there are {', '.join(short(channel.name) for channel in channels.outputs)}; name one of them"
        raise UnusableInput(f"{where} needs a single output whose kind is position, velocity or level; {remedy}")
    controller = table.get("controller")
    used: list[str] = []

    def constant(owner: Mapping[str, Any], key: str) -> Known | None:
        return _known(owner[key], key, channels, where, used) if key in owner else None

    if controller is not None:
        _check_table(controller, CONTROLLER_KEYS, f"{where}: controller", required=("goal",))
        if output.kind != "position":
            raise UnusableInput(f"{where}: a controller of a {output.kind} is not known here; leave it out")
    others = OF_A_BODY if output.kind == "level" else OF_A_TANK
    if foreign := [key for key in others if key in table]:
        own = "a tank has an area" if output.kind == "level" else "a body has a mass or an inertia"
        raise UnusableInput(f"{where}: {foreign[0]} is nothing of a {output.kind}; {own}, so leave it out")
    known = {key: constant(table, key) for key in ("mass", "arm", "damping", "supply")}
    inertia = constant(table, "inertia") or constant(table, "area")
    of_controller = {key: constant(controller or {}, key) for key in ("gain", "derivative")}
    enabled = _column(table["enabled"], "enabled", inputs, where, used) if "enabled" in table else ""
    for key in ("damping", "derivative"):
        number = (known | of_controller).get(key)
        if number is not None and number.column:
            raise UnusableInput(f"{where}: {key} must be a number or an interval, not a column")
    if known["arm"] is not None and known["mass"] is None:
        raise UnusableInput(f"{where}: arm needs the mass that it carries; add mass, or give inertia")
    drive = _drive(table, inputs, used, where)
    radian = _scale(output.unit, table.get("ticks_per_turn"), where)
    gravity = _gravity(table.get("gravity", False), known, output.unit, where)
    goal_unit = channels.inputs[inputs.index(drive)].unit
    factor = 1.0
    if controller is not None and goal_unit != output.unit:
        if (of_motion(goal_unit).kind == "length") != (of_motion(output.unit).kind == "length"):
            raise UnusableInput(f"{where}: the goal is in {goal_unit or '1'}, the output in {output.unit or '1'}; "
                                "give both a unit of the same quantity")  # fmt: skip
        factor = _scale(goal_unit, table.get("ticks_per_turn"), where) / radian
    return KnownPlant(
        input=drive, controlled=controller is not None, **of_controller, enabled=enabled,
        differentiates=bool(controller) and "derivative" in controller, **known, inertia=inertia, gravity=gravity,
        hangs_at=_number(table.get("hangs_at", 0.0), "hangs_at", where), radian=radian, goal_factor=factor,
    )  # fmt: skip


def _drive(table: Mapping[str, Any], inputs: Sequence[str], used: list[str], where: str) -> str:
    """Find the column of the goal or of the drive; every input must then be something."""
    controller = table.get("controller")
    drive = controller["goal"] if controller is not None else table.get("input")
    if controller is not None and "input" in table:
        raise UnusableInput(f"{where}: the goal of the controller is the input; leave input out")
    if drive is None:
        free = [name for name in inputs if name not in used]
        if len(free) != 1:
            raise UnusableInput(f"{where}: which input drives it? Write input = one of {', '.join(free or inputs)}")
        drive = free[0]
    drive = _column(drive, "goal" if controller is not None else "input", inputs, where, used)
    unused = [name for name in inputs if name not in used]
    if unused:
        raise UnusableInput(
            f"{where}: it does not say what {short(unused[0])} is; name it there, or take it out of the inputs"
        )
    return drive


def check_records(
    plant: KnownPlant, experiments: Sequence[Experiment], channels: Channels, where: str, called: str = IN_FILE
) -> None:
    """Refuse columns that cannot be what the table says they are. Raises UnusableInput."""
    names = [channel.name for channel in channels.inputs]
    for key in ("mass", "arm", "inertia"):
        known: Known | None = getattr(plant, key)
        column = known.column if known is not None else ""
        for x in experiments if column else ():
            values = x.u[:, names.index(column)]
            if np.ptp(values) > 0 or values[0] <= 0:
                what = "changes" if np.ptp(values) > 0 else f"is {values[0]:g}"
                raise UnusableInput(
                    f"{where}: {called}: the column {short(column)} {what} in {x.name}; "
                    f"{key} must be one positive number in each experiment"
                )
    on = [x.u[:, names.index(plant.enabled)].any() for x in experiments] if plant.enabled else [True]
    if not any(on):
        raise UnusableInput(f"{where}: {called}: the column {short(plant.enabled)} is 0 throughout, so nothing drives")
    for x in experiments if plant.enabled else ():
        if not np.isin(x.u[:, names.index(plant.enabled)], (0.0, 1.0)).all():
            raise UnusableInput(
                f"{where}: {called}: the column {short(plant.enabled)} of {x.name} must hold 0 (off) and 1 (on) only"
            )


def with_known(dataset: Dataset, table: Mapping[str, Any] | None) -> Dataset:
    """Say of a data set what is known of its machine, as a table [plant] would. Raises UnusableInput."""
    if not table:
        return dataset
    if dataset.channels.plant is not None:
        raise UnusableInput(f"{dataset.name} has a table {IN_FILE} already; write {AS_OPTION} into that")
    plant = read_plant(table, dataset.channels, dataset.name, AS_OPTION)
    channels = replace(dataset.channels, plant=plant)
    training = dataset.training
    check_records(plant, (*training.train, *training.valid, *dataset.test), channels, dataset.name, AS_OPTION)
    return dataset.with_channels(channels)


def read_forces(table: Mapping[str, Any], where: str = "--known") -> dict[str, float]:
    """Read what gives a linear model its forces: {"inertia": kg m^2 or kg} and, or, {"torque_constant": N m or N}.

    inertia + mass arm^2, or inertia + mass without an arm. Raises UnusableInput.
    """
    _check_table(table, ("inertia", "mass", "arm", "torque_constant"), where)
    if "arm" in table and "mass" not in table:
        raise UnusableInput(f"{where}: arm needs the mass that it carries; add mass, or give inertia")
    read = {key: _quantity(value, key, where, key) for key, value in table.items() if key != "torque_constant"}
    inertia = read.get("inertia", 0.0) + read.get("mass", 0.0) * read.get("arm", 1.0) ** 2
    forces = {"inertia": inertia} if inertia else {}
    if "torque_constant" in table:
        forces["torque_constant"] = _quantity(table["torque_constant"], "torque_constant", where)
    return forces


def parse_known(options: Sequence[str], where: str = "--known") -> dict[str, Any]:
    """Turn `mass=0.5kg`, `controller.goal=r` or `arm=0.1..0.12m` into a table. Raises UnusableInput."""
    table: dict[str, Any] = {}
    for option in options:
        key, sign, value = option.partition("=")
        if not sign or not key.strip() or not value.strip():
            raise UnusableInput(f"{where}: {short(option)} must be written like mass=0.5kg")
        *path, name = key.strip().split(".")
        owner = table
        for part in path:
            owner = owner.setdefault(part, {})
            if not isinstance(owner, dict):
                raise UnusableInput(f"{where}: {part} is given twice, once as a number or a column; give it once")
        if name in owner:
            raise UnusableInput(f"{where}: {key.strip()} is given twice; give it once")
        value = value.strip()
        low, between, high = value.partition("..")
        if between:
            end = NUMBER.fullmatch(high)
            owner[name] = {"low": low + (end[2] or "" if end else ""), "high": high}
        elif value in ("true", "false"):
            owner[name] = value == "true"
        else:
            owner[name] = float(value) if (found := NUMBER.fullmatch(value)) and not found[2] else value
    return table


def _known(value: Any, key: str, channels: Channels, where: str, used: list[str]) -> Known:
    if isinstance(value, Mapping):
        _check_table(value, INTERVAL_KEYS, f"{where}: {key}", required=("low", "high"))
        low, high = (_quantity(value[end], key, where, f"{key}.{end}") for end in ("low", "high"))
        middle = _quantity(value["value"], key, where, f"{key}.value") if "value" in value else 0.5 * (low + high)
        if not low < high or not low <= middle <= high:
            raise UnusableInput(f"{where}: {key} must have low < high, and its value between them")
        return Known(middle, low, high)
    names = [channel.name for channel in channels.inputs]
    if isinstance(value, str) and (value in names or not NUMBER.fullmatch(value)):
        column = _column(value, key, names, where, used)
        unit = channels.inputs[names.index(column)].unit
        unit = unit if UNITS[key] else ""  # of a controller's gain it may be anything
        return Known(column=column, factor=_factor(unit, key, where, f"{key}, column {short(column)},"))
    number = _quantity(value, key, where, key)
    return Known(number, number, number)


def _quantity(value: Any, key: str, where: str, called: str = "") -> float:
    number, unit = value, ""
    if isinstance(value, str) and (found := NUMBER.fullmatch(value)):
        number, unit = float(found[1]), found[2] or ""
    called = called or key
    number = _number(number, called, where)
    if number < 0 or (number == 0 and key in ("mass", "arm", "supply", "gain", "torque_constant")):
        raise UnusableInput(f"{where}: {called} is {number:g}; it must be positive")
    return number * _factor(unit, key, where, called)


def _factor(unit: str, key: str, where: str, called: str) -> float:
    plain = re.sub(r"[\s^*·]", "", unit).replace("²", "2")
    if not plain:
        return 1.0
    known = UNITS[key]
    if plain not in known:
        remedy = (
            f"write it in one of {', '.join(known)}"
            if known
            else ("write it without: it is the controller's output for an error of 1 in the unit of the output")
        )
        raise UnusableInput(f"{where}: {called} is in {short(unit)}; {remedy}")
    return known[plain]


def _number(value: Any, key: str, where: str) -> float:
    if type(value) not in (int, float) or not math.isfinite(value):
        raise UnusableInput(f"{where}: {key} is {short(value)}; give a number, an input column, or low and high")
    return float(value)


def _column(value: Any, key: str, inputs: Sequence[str], where: str, used: list[str]) -> str:
    if not isinstance(value, str) or value not in inputs:
        raise UnusableInput(f"{where}: {key} is {short(value)}, which is no input; there are {', '.join(inputs)}")
    if value in used:
        raise UnusableInput(f"{where}: the input {short(value)} is named twice; it is one thing only")
    used.append(value)
    return value


def _scale(unit: str, ticks_per_turn: Any, where: str) -> float:
    """Return how many rad (or m) a unit of a position is; of what is neither, 1."""
    if unit in TICKS and ticks_per_turn is None:
        raise UnusableInput(f"{where}: an angle is in {unit}; add ticks_per_turn")
    if unit in TICKS:
        ticks = _number(ticks_per_turn, "ticks_per_turn", where)
        if ticks <= 0:
            raise UnusableInput(f"{where}: ticks_per_turn is {ticks:g}; it must be positive")
        return TURN / ticks
    return of_motion(unit).factor


def _gravity(value: Any, known: Mapping[str, Known | None], unit: str, where: str) -> float:
    if value is False:
        return 0.0
    if known["mass"] is None or known["arm"] is None:
        raise UnusableInput(f"{where}: gravity needs mass and arm; without them leave it out, and it is looked for")
    if of_motion(unit).kind != "angle" and unit not in TICKS:
        raise UnusableInput(f"{where}: gravity acts on an angle; the output is in {unit or '1'}, so write its unit")
    return STANDARD_GRAVITY if value is True else _number(value, "gravity", where)


def _check_table(content: Any, known: Sequence[str], where: str, required: Sequence[str] = ()) -> None:
    if not isinstance(content, Mapping):
        raise UnusableInput(f"{where} must be a table")
    for key in content:
        if key not in known:
            raise UnusableInput(f"{where}: unknown key {short(key)}; known are {', '.join(known)}")
    for key in required:
        if key not in content:
            raise UnusableInput(f"{where}: {key} is missing; add it")
