"""dataset.toml: what the files of a data set folder are, checked key by key."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from reprlib import repr as short
from typing import Any, get_args

from simgap.data.formats.plant_table import read_plant
from simgap.data.kinds import kind_of
from simgap.records import LARGEST_VALUE, Channel, Channels, Kind, UnusableInput

FILE = "dataset.toml"
KINDS = get_args(Kind)
KEYS = ("name", "sampling_time", "time", "n_init", "inputs", "outputs", "splits", "plant")
CHANNEL_KEYS = ("name", "unit", "kind", "kind_from")
NOT_WRITTEN = ("header", "option")  # where a saved kind came from, if nobody had written it
SPLITS = ("train", "valid", "test")


@dataclass(frozen=True)
class Description:
    """The content of a dataset.toml; sampling time in seconds, splits as glob patterns."""

    name: str
    sampling_time: float
    time: str | None
    n_init: int | None
    channels: Channels
    splits: dict[str, str]


def read_description(file: Path) -> Description:
    """Read a dataset.toml. Raises UnusableInput that names the line or the key that is wrong."""
    content = _parse(file)
    _check_keys(content, KEYS, str(file), required=("name", "sampling_time", "inputs", "outputs", "splits"))
    dt, n_init = content["sampling_time"], content.get("n_init")
    if type(dt) not in (int, float) or not 0 < dt <= LARGEST_VALUE:
        raise UnusableInput(f"{file}: sampling_time must be a positive number of seconds, such as 0.1")
    if n_init is not None and (type(n_init) is not int or not 1 <= n_init <= 2**31):
        raise UnusableInput(f"{file}: n_init must be a whole number of samples, 1 or more")
    channels = Channels(_channels(content["inputs"], "inputs", file), _channels(content["outputs"], "outputs", file))
    if "plant" in content:
        channels = replace(channels, plant=read_plant(content["plant"], channels, str(file)))
    time = _text(content["time"], "time", file) if "time" in content else None
    check_columns(columns_of(channels) + ((time,) if time else ()), str(file))
    splits = content["splits"]
    if not isinstance(splits, dict):
        raise UnusableInput(f"{file}: splits must be a table, [splits], of glob patterns")
    _check_keys(splits, SPLITS, f"{file}: [splits]", required=("train", "test"))
    patterns = {split: _text(splits[split], f"splits.{split}", file) for split in SPLITS if split in splits}
    return Description(_text(content["name"], "name", file), float(dt), time, n_init, channels, patterns)


def columns_of(channels: Channels) -> tuple[str, ...]:
    """List the names of all inputs, then of all outputs."""
    return tuple(channel.name for channel in channels.inputs + channels.outputs)


def check_columns(columns: tuple[str, ...], source: str) -> None:
    """Raise UnusableInput unless each name can stand in a header line and none is used twice."""
    for column in columns:
        if not column or not column.isprintable() or column != column.strip():
            raise UnusableInput(
                f"{source}: {short(column)} cannot name a column; use visible characters, no blanks around"
            )
        if columns.count(column) > 1:
            raise UnusableInput(
                f"{source}: column {short(column)} is named twice; it is one input, one output or the time"
            )


def _parse(file: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(file.read_bytes().decode("utf-8-sig"))
    except OSError as error:
        raise UnusableInput(f"{file} cannot be read ({error.strerror}); check its permissions") from error
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise UnusableInput(f"{file}: line {line} is not UTF-8 text; save the file as UTF-8") from None
    except RecursionError:
        raise UnusableInput(f"{file}: brackets are nested too deeply; write it as the format says") from None
    except ValueError as error:  # tomllib.TOMLDecodeError, and int() on thousands of digits
        why = " ".join(str(error).split())
        raise UnusableInput(f"{file}: this is no TOML: {why}; correct it there") from None


def _channels(entries: Any, key: str, file: Path) -> tuple[Channel, ...]:
    if not isinstance(entries, list) or not entries or not all(isinstance(entry, dict) for entry in entries):
        raise UnusableInput(f"{file}: {key} must be one [[{key}]] table per column, at least one")
    channels = []
    for entry in entries:
        _check_keys(entry, CHANNEL_KEYS, f"{file}: [[{key}]]", required=("name",))
        kind, kind_from = entry.get("kind"), entry.get("kind_from", "written" if "kind" in entry else "unknown")
        if "kind" in entry and kind not in KINDS:
            raise UnusableInput(f"{file}: {key} has the kind {short(kind)}; use one of {', '.join(KINDS)}")
        if "kind_from" in entry and (kind_from not in NOT_WRITTEN or "kind" not in entry):
            known = " or ".join(NOT_WRITTEN)
            raise UnusableInput(f"{file}: {key} has the kind_from {short(kind_from)}; {known} can stand beside a kind")
        name = _text(entry["name"], f"name of {key}", file)
        unit = _text(entry.get("unit", ""), f"unit of {key}", file, may_be_empty=True)
        if kind is None and (kind := kind_of(name, unit)):
            kind_from = "header"
        channels.append(Channel(name, unit, kind or "other", kind_from))
    return tuple(channels)


def _text(value: Any, key: str, file: Path, may_be_empty: bool = False) -> str:
    if not isinstance(value, str) or not value.isprintable() or not (value or may_be_empty):
        raise UnusableInput(f"{file}: {key} must be a text in quotes on one line, not {short(type(value).__name__)}")
    return value


def _check_keys(content: dict[str, Any], known: tuple[str, ...], where: str, required: tuple[str, ...]) -> None:
    for key in content:
        if key not in known:
            raise UnusableInput(f"{where}: unknown key {short(key)}; known are {', '.join(known)}")
    for key in required:
        if key not in content:
            raise UnusableInput(f"{where}: {key} is missing; add it")
