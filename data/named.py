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
    return text in DATASETS or (_split(text) is not None and not os.path.exists(text))  # noqa: PTH110, it never raises


def load_registered(text: str) -> Dataset:
    """Make a registered data set; its name holds the parameters that are not the usual ones. Raises UnusableInput."""
    split = _split(text)
    if split is None:
        return DATASETS[text]()
    name, pairs = split
    usual = usual_parameters(name)
    given = _numbers(name, pairs, usual)
    changed = [f"{key}{given[key]:.15g}" for key in usual if given.get(key, usual[key]) != usual[key]]
    return replace(DATASETS[name](**given), name="-".join([name, *changed]))


def _split(text: str) -> tuple[str, list[tuple[str, str]]] | None:
    """Split "gimbal-noise4" into the name and the pairs of parameter and number; None for any other text."""
    name, *pieces = text.split("-")
    if text in DATASETS or name not in DATASETS or not all(map(PARAMETER.fullmatch, pieces)):
        return None
    return name, [PARAMETER.findall(piece)[0] for piece in pieces]


def _numbers(name: str, pairs: Sequence[tuple[str, str]], usual: Mapping[str, int | float]) -> dict[str, int | float]:
    numbers: dict[str, int | float] = {}
    for key, number in pairs:
        if key not in usual or key in numbers:
            takes = f"it takes {', '.join(usual)}, each once" if usual else "it takes none"
            raise UnusableInput(f"data set {name} has no parameter {key + number!r}; {takes}")
        value = float(number)
        if isinstance(usual[key], int) and value != round(value):
            raise UnusableInput(f"data set {name}: {key} is a whole number, such as {usual[key]}")
        numbers[key] = int(value) if isinstance(usual[key], int) else value
    return numbers


def parameters_of(text: str) -> tuple[str, dict[str, float]]:
    """Split a name such as "gimbal-noise4" into the data set's own and its parameters; of any other there are none."""
    split = _split(text)
    if split is None:
        return text, {}
    name, pairs = split
    changed = {key: float(number) for key, number in pairs}
    return (name, changed) if changed.keys() <= usual_parameters(name).keys() else (text, {})


def usual_parameters(name: str) -> dict[str, int | float]:
    """List the parameters that a registered data set takes, with what they usually are."""
    parameters = inspect.signature(DATASETS[name]).parameters
    return {key: one.default for key, one in parameters.items() if isinstance(one.default, int | float)}
