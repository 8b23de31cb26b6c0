"""What a folder of results holds of the recovery study: the confusion matrix, its figures, and rates."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from simgap.records import UnusableInput
from simgap.reports.confusion import NOTHING, SUSPECTED, UNEXPLAINED, matrix
from simgap.reports.recovery_rates import rate_tables
from simgap.reports.tables import Cell, Table
from simgap.results import lines

FOLDER, FILE, SUMMARY, RATES = "recovery", "cases.jsonl", "summary.json", "rates.json"


def read(folder: Path) -> dict[str, Any]:
    """Read the confusion matrix, the stored summary and the tables of the rates; empty where there is none of them.

    Raises UnusableInput for a summary or rates that simgap did not write.
    """
    file = folder / FOLDER / FILE
    rows = [json.loads(line) for line in lines.read(file) if lines.is_json(line)] if file.is_file() else []
    known = [row for row in rows if isinstance(row, dict) and row.get("status") == "ok" and "case" in row]
    latest = {json.dumps(row["case"], sort_keys=True): row for row in known}
    counts = dict(sorted(matrix(latest.values()).items()))
    special = [SUSPECTED, NOTHING, UNEXPLAINED]
    named = sorted({name for counter in counts.values() for name in counter} - set(special))
    summary, rates = _summary(folder / FOLDER / SUMMARY), _rates(folder / FOLDER / RATES)
    if not counts and not summary and not rates:
        return {}
    return {"counts": counts, "answers": [*named, *special], "summary": summary, "rates": rates}


def tables(folder: Path) -> list[Table]:
    """The figures of the study and the rates of several tools, as far as they are stored. Raises UnusableInput."""
    cases = read(folder)
    if not cases:
        return []
    rows = [[Cell(label), Cell(text)] for label, text in cases["summary"]]
    right = [Table("Effects hidden in simulated rigs, named by simgap diagnose", ["figure", "value"], rows)]
    return [*(right if rows else []), *cases["rates"]]


def _summary(file: Path) -> list[tuple[str, str]]:
    if not file.is_file():
        return []
    try:
        known = json.loads(file.read_bytes())
    except (ValueError, RecursionError):
        raise UnusableInput(f"{file} is no JSON; `simgap run recovery` writes it") from None
    return list(known.items()) if isinstance(known, dict) else []


def _rates(file: Path) -> list[Table]:
    if not file.is_file():
        return []
    try:
        return rate_tables(json.loads(file.read_bytes()))
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError, StopIteration):
        raise UnusableInput(f"{file} holds no rates; `simgap recovery score --json {file}` writes them") from None
