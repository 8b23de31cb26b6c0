"""How far the answers rest on a threshold: every one that decides is lowered by a third and raised by half.

A threshold that was set again with one data set left out could only move within the range where the other sets keep
their answers. Where no answer changes over that range, leaving a set out changes none either.

python tests/diagnosis/thresholds.py FOLDER [FOLDER ..]          what changes, one line for each value
"""

from __future__ import annotations

import importlib
import pkgutil
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import simgap.diagnosis
import simgap.error_views
import simgap.greybox
from simgap.data import load
from simgap.diagnosis.diagnose import diagnose

FACTORS = (2 / 3, 3 / 2)
THRESHOLDS = (
    ("simgap.greybox.held_out", "BY_CHANCE"),
    ("simgap.greybox.trial", "FALSE_NAMES"),
    ("simgap.greybox.trial", "HELD_OUT"),
    ("simgap.greybox.trial", "CONSISTENT"),
    ("simgap.greybox.trial", "MATTERS"),
    ("simgap.greybox.trial", "MATTERS_AT_ALL"),
    ("simgap.greybox.trial", "OF_MEMORY"),
    ("simgap.greybox.trial", "HALVES_LEAVE"),
    ("simgap.greybox.trial", "PIECES_LEAVE"),
    ("simgap.greybox.trial", "ALIKE"),
    ("simgap.greybox.trial", "WORST"),
    ("simgap.greybox.search", "BETTER"),
    ("simgap.greybox.search", "CONFIRMED"),
    ("simgap.greybox.dynamics", "SETTLED"),
    ("simgap.greybox.linear", "WORTH_AN_ORDER"),
    ("simgap.greybox.linear", "UNEXPLAINED"),
    ("simgap.greybox.linear", "EARLY"),
    ("simgap.greybox.linear_rival", "BEYOND"),
    ("simgap.greybox.rivals", "UNEXPLAINED"),
    ("simgap.greybox.identification", "STILL_FAR"),
    ("simgap.greybox.kind_of_output", "ALIKE"),
    ("simgap.greybox.outliers", "APART"),
    ("simgap.diagnosis.promises", "MOST"),
    ("simgap.diagnosis.doubts", "TOGETHER"),
    ("simgap.diagnosis.doubts", "CERTAIN"),
    ("simgap.diagnosis.diagnose", "LEFT_OF_EXPLAINED"),
)


@contextmanager
def threshold(module: str, name: str, factor: float) -> Iterator[float]:
    """Multiply a threshold within this block, wherever it was imported to; of a share, what is missing to 1."""
    usual = getattr(importlib.import_module(module), name)
    value = 1 - (1 - usual) / factor if name == "MOST" else usual * factor
    holders = [one for one in _modules() if getattr(one, name, None) is usual]
    for one in holders:
        setattr(one, name, value)
    try:
        yield value
    finally:
        for one in holders:
            setattr(one, name, usual)


@cache
def _modules() -> list[object]:
    return [
        importlib.import_module(found.name)
        for package in (simgap.error_views, simgap.greybox, simgap.diagnosis)
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
    ]


def answers(folders: list[str]) -> dict[str, str]:
    """Diagnose every data set and return verdicts and names."""
    found = {}
    for folder in folders:
        answer = diagnose(load(folder), views_too=False)
        names = [cause.effect for cause in (*answer.causes, *answer.suspects)]
        found[Path(folder).name] = " ".join([answer.verdict, *names])
    return found


def main() -> None:
    """Write the answers with the usual thresholds, and for each other value those that are not the same."""
    warnings.simplefilter("ignore")
    usual = answers(sys.argv[1:])
    for name, answer in usual.items():
        print(f"{name}: {answer}", flush=True)
    for module, name in THRESHOLDS:
        for factor in FACTORS:
            with threshold(module, name, factor) as value:
                changed = [f"{of}: {now}" for of, now in answers(sys.argv[1:]).items() if now != usual[of]]
            print(f"{module.removeprefix('simgap.')}.{name} {value:.3g}  {'; '.join(changed) or 'same'}", flush=True)


if __name__ == "__main__":
    main()
