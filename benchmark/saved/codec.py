"""A fitted model as JSON and arrays, and back. Reading executes nothing: names are looked up, fields are checked."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import jaxtyped

from simgap.records import UnusableInput
from simgap.registry import EFFECTS, MODELS
from simgap.running.annotations import fits, hints_of

# Kinds of NumPy numbers that a file holds: booleans, whole numbers and floats.
NUMBERS = "biuf"


@dataclass
class Encoder:
    """Turns a fitted model into JSON; its arrays, under the names of the attributes, are left in `arrays`."""

    arrays: dict[str, np.ndarray] = field(default_factory=dict)

    def model(self, model: Any, at: str = "") -> dict[str, Any]:
        """Encode a registered model. Raises UnusableInput for one that is not, and for what no file can hold."""
        kind = type(model)
        return {"model": name_of(kind), "state": self._state(state_of(model), getattr(kind, "parts", ()), at)}

    def _state(self, state: dict[str, Any], parts: tuple[type, ...], at: str) -> dict[str, Any]:
        return {name: self._value(value, parts, f"{at}.{name}" if at else name) for name, value in state.items()}

    def _value(self, value: Any, parts: tuple[type, ...], at: str) -> Any:
        if value is None or type(value) in (bool, int, str):
            return value
        if type(value) is float:
            return value if math.isfinite(value) else {"float": repr(value)}
        if isinstance(value, np.ndarray | np.generic):
            return self._array(value, at)
        if type(value) in (list, tuple, dict):
            return self._container(value, parts, at)
        return self._object(value, parts, at)

    def _container(self, value: Any, parts: tuple[type, ...], at: str) -> Any:
        if isinstance(value, dict):
            keys = [self._value(key, parts, f"{at}.key") for key in value]
            return {"keys": keys, "values": [self._value(one, parts, f"{at}.{key}") for key, one in value.items()]}
        encoded = [self._value(one, parts, f"{at}.{i}") for i, one in enumerate(value)]
        return {"tuple": encoded} if isinstance(value, tuple) else encoded

    def _object(self, value: Any, parts: tuple[type, ...], at: str) -> Any:
        kind = type(value)
        if kind in parts:
            return {"part": kind.__name__, "state": self._state(state_of(value), parts, at)}
        name = getattr(kind, "name", "")
        laws = EFFECTS[name].laws() if isinstance(name, str) and name in EFFECTS else {}
        if kind in laws.values():
            return {next(what for what, law in laws.items() if law is kind): name}
        if callable(getattr(kind, "simulate", None)):
            return self.model(value, at)
        raise _refused(at, f"a {kind.__qualname__}")

    def _array(self, value: np.ndarray | np.generic, at: str) -> dict[str, Any]:
        if value.dtype.kind not in NUMBERS:
            raise _refused(at, f"an array of {value.dtype}")
        while at in self.arrays:  # the keys of two dicts may read alike
            at += "'"
        # In the order in which it lies in memory, which decides in which order sums are taken.
        turned = isinstance(value, np.ndarray) and value.flags.f_contiguous and not value.flags.c_contiguous
        self.arrays[at] = np.array(value.T if turned else value, dtype=value.dtype.newbyteorder("="), order="C")
        return {"number" if isinstance(value, np.generic) else "turned" if turned else "array": at}


def decode_model(text: Any, arrays: dict[str, np.ndarray]) -> Any:
    """Build the model that `Encoder.model` encoded. Raises UnusableInput, ValueError, TypeError, KeyError and such."""
    kind = MODELS[str(text["model"])]
    parts = {part.__name__: part for part in getattr(kind, "parts", ())}
    state = {name: _decoded(value, arrays, parts) for name, value in text["state"].items()}
    check_types(kind, state)
    if hasattr(kind, "from_saved"):
        return kind.from_saved(state)
    model = kind.__new__(kind)
    for name, value in state.items():
        if name.startswith("_") or callable(getattr(kind, name, None)):
            raise ValueError(f"a model has no attribute {name!r}")
        setattr(model, name, value)
    return model


def _decoded(text: Any, arrays: dict[str, np.ndarray], parts: dict[str, type]) -> Any:
    def each(values: list[Any]) -> list[Any]:
        return [_decoded(value, arrays, parts) for value in values]

    match text:
        case None | bool() | int() | float() | str():
            value = text
        case list():
            value = each(text)
        case {"float": digits}:
            value = float(digits)
        case {"array": name}:
            value = arrays[name]
        case {"turned": name}:
            value = arrays[name].T
        case {"number": name}:
            value = arrays[name][()]
        case {"tuple": values}:
            value = tuple(each(values))
        case {"keys": keys, "values": values}:
            value = dict(zip(each(keys), each(values), strict=True))
        case {"effect": name} | {"refined": name} | {"steady": name} | {"of_each": name}:
            (what,) = text
            value = EFFECTS[str(name)].laws()[what]()
        case {"part": name, "state": state}:
            value = build_record(parts[name], dict(zip(state, each(list(state.values())), strict=True)))
        case _:
            value = decode_model(text, arrays)
    return value


def build_record(part: type, state: dict[str, Any]) -> Any:
    """Build a record from its fields. Raises TypeError for fields that it has not, or of another type."""
    check_types(part, state)
    return part.from_saved(state) if hasattr(part, "from_saved") else part(**state)


def check_types(kind: type, state: dict[str, Any]) -> None:
    """Raise TypeError for an attribute that is not of its annotated type and shape; one letter is one size in all."""
    hints = hints_of(kind)
    with jaxtyped("context"):
        for name, value in state.items():
            if name in hints and not fits(value, hints[name]):
                raise TypeError(f"the {name} of a {kind.__name__} is not of its type and shape")


def state_of(value: Any) -> dict[str, Any]:
    """What a file holds of an object: the fields of a record; of a model all that is not private or only cached."""
    if hasattr(value, "saved_state"):
        return value.saved_state()
    kind = type(value)
    if is_dataclass(kind) and not callable(getattr(kind, "fit", None)):
        return {f.name: getattr(value, f.name) for f in fields(kind) if f.init}
    return {
        name: one for name, one in vars(value).items()
        if not (name.startswith("_") or isinstance(getattr(kind, name, None), cached_property))
    }  # fmt: skip


def name_of(kind: type) -> str:
    """The registered name of a model's class, or that of the model as which it is saved. Raises UnusableInput."""
    try:
        return MODELS.name_of(kind)
    except UnusableInput as error:
        if name := getattr(kind, "saved_as", ""):
            return name
        raise UnusableInput(
            f"{kind.__qualname__} is not registered, and a file names the model that reads it; register it "
            f"(docs/own_model.md)"
        ) from error


def _refused(at: str, what: str) -> UnusableInput:
    return UnusableInput(
        f"the model cannot be saved: {at} is {what}; a file holds numbers, texts, lists, tuples, dicts, arrays of "
        f"numbers, effects, models and the records in the class's `parts`"
    )
