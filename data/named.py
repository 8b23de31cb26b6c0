"""Registered data sets by name, with parameters behind it where one takes them: "gimbal-noise4-delay0.2"."""

from __future__ import annotations

import inspect
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from simgap.records import Dataset, UnusableInput
from simgap.registry import DATASETS

PARAMETER = re.compile(r"([a-z_]+)(\d{1,9}(?:\.\d{1,9})?)")


def is_registered(text: str) -> bool:
    """Tell whether a text is the name of a registered data set, with or without parameters.

    A file or folder whose name looks like one with parameters is what it is.
    """
    if text in DATASETS:
        return True
    name, *pieces = text.split("-")
    return name in DATASETS and all(map(PARAMETER.fullmatch, pieces)) and not os.path.exists(text)  # noqa: PTH110, it never raises


def load_registered(text: str) -> Dataset:
    """Make a registered data set; its name holds the parameters that are not the usual ones. Raises UnusableInput."""
    if text in DATASETS:
        return DATASETS[text]()
    name, *pieces = text.split("-")
    usual = usual_parameters(name)
    given = _numbers(name, pieces, usual)
    changed = [f"{key}{given[key]:.15g}" for key in usual if given.get(key, usual[key]) != usual[key]]
    return replace(DATASETS[name](**given), name="-".join([name, *changed]))


def _numbers(name: str, pieces: Sequence[str], usual: Mapping[str, float]) -> dict[str, float]:
    numbers: dict[str, float] = {}
    for piece in pieces:
        key, number = PARAMETER.findall(piece)[0]
        if key not in usual or key in numbers:
            takes = f"it takes {', '.join(usual)}, each once" if usual else "it takes none"
            raise UnusableInput(f"data set {name} has no parameter {piece!r}; {takes}")
        value = float(number)
        if isinstance(usual[key], int) and value != round(value):
            raise UnusableInput(f"data set {name}: {key} is a whole number, such as {usual[key]}")
        numbers[key] = int(value) if isinstance(usual[key], int) else value
    return numbers


def parameters_of(text: str) -> tuple[str, dict[str, float]]:
    """Split a name such as "gimbal-noise4" into the data set's own and its parameters; of any other there are none."""
    name, *pieces = text.split("-")
    if text in DATASETS or name not in DATASETS or not all(map(PARAMETER.fullmatch, pieces)):
        return text, {}
    changed = {key: float(value) for key, value in (PARAMETER.findall(piece)[0] for piece in pieces)}
    return (name, changed) if changed.keys() <= usual_parameters(name).keys() else (text, {})


def usual_parameters(name: str) -> dict[str, float]:
    """List the parameters that a registered data set takes, with what they usually are."""
    parameters = inspect.signature(DATASETS[name]).parameters
    return {key: one.default for key, one in parameters.items() if isinstance(one.default, int | float)}
