"""The recovery study of a folder of results, for its page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from simgap.reports.confusion import NOTHING, SUSPECTED, UNEXPLAINED, matrix
from simgap.results import lines

FOLDER, FILE, SUMMARY = "recovery", "cases.jsonl", "summary.json"


def read(folder: Path) -> dict[str, Any]:
    """Read the confusion matrix and, where it is stored, the summary; empty without cases that are visible."""
    file = folder / FOLDER / FILE
    rows = [json.loads(line) for line in lines.read(file) if lines.is_json(line)] if file.is_file() else []
    known = [row for row in rows if isinstance(row, dict) and row.get("status") == "ok"]
    latest = {json.dumps(row["case"], sort_keys=True): row for row in known}
    counts = dict(sorted(matrix(latest.values()).items()))
    if not counts:
        return {}
    special = [SUSPECTED, NOTHING, UNEXPLAINED]
    named = sorted({name for counter in counts.values() for name in counter} - set(special))
    return {"counts": counts, "answers": [*named, *special], "summary": _summary(folder / FOLDER / SUMMARY)}


def _summary(file: Path) -> list[tuple[str, str]]:
    if not file.is_file():
        return []
    known = json.loads(file.read_text(encoding="utf-8"))
    return list(known.items()) if isinstance(known, dict) else []
