"""File names of pages, and texts from data sets on their way into plots."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from typing import Any

from simgap.reports.rendering import printable
from simgap.reports.tables import with_unit


def file_names(labels: Iterable[str]) -> dict[str, str]:
    """Give each label a file name of its own, without ending: letters, digits, '_', '.', '-'.

    Names that differ only in case get numbers, because some file systems take them for one.
    """
    names: dict[str, str] = {}
    taken: set[str] = set()
    for label in labels:
        name = base = re.sub(r"[^A-Za-z0-9_.-]+", "-", label).strip("-.") or "unnamed"
        number = 1
        while name.lower() in taken:
            number += 1
            name = f"{base}-{number}"
        taken.add(name.lower())
        names[label] = name
    return names


def plot_text(text: str, unit: str = "") -> str:
    """Write a name with its unit for plotly, which obeys some HTML in texts, so that none may be left."""
    whole = printable(with_unit(text, unit))
    return whole.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def script(call: str, *arguments: Any) -> str:
    """Write a call of a function with JSON arguments as a script file."""
    listed = ", ".join(json.dumps(argument, allow_nan=False, separators=(",", ":")) for argument in arguments)
    return f"{call}({listed});\n"
