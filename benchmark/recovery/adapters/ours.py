"""`simgap.diagnose` on a case."""

from __future__ import annotations

from collections.abc import Sequence

from simgap.diagnosis.diagnose import diagnose
from simgap.findings import Cause
from simgap.records import Dataset
from simgap.registry import ADAPTERS


@ADAPTERS.register("simgap")
def answer(dataset: Dataset) -> dict[str, list[list[str]]]:
    """The causes that a diagnosis names, each with those that it cannot tell it apart from, and the suspects."""
    findings = diagnose(dataset, views_too=False).findings
    return {"names": _sets(findings.causes), "suspects": _sets(findings.suspects)}


def _sets(causes: Sequence[Cause]) -> list[list[str]]:
    return [[cause.effect, *(other.effect for other in cause.confounded_with)] for cause in causes]
