"""The answer of `simgap.diagnose`: findings that show themselves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from simgap.findings import Cause, Findings
from simgap.greybox.model import GreyBoxModel


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What was found, as a text, a page or JSON; `model` simulates with the causes or, without any, with the suspects.

    It is `greybox-auto`, fitted without the test split, less the effects that the test split did not confirm.
    """

    findings: Findings
    seconds: float
    model: GreyBoxModel

    def __post_init__(self) -> None:
        object.__setattr__(self, "findings", replace(self.findings, seconds=self.seconds))

    @property
    def verdict(self) -> str:
        """named, suspected, nothing_found or unexplained."""
        return self.findings.verdict

    @property
    def causes(self) -> tuple[Cause, ...]:
        """The named effects, in the order of what they explain."""
        return self.findings.causes

    @property
    def suspects(self) -> tuple[Cause, ...]:
        """The effects that passed in training, while their gain on the test split may be chance."""
        return self.findings.suspects

    def to_json(self) -> dict[str, Any]:
        """Schema 1 of `simgap diagnose --json`."""
        return self.findings.to_json()

    def to_html(self) -> str:
        """One page that needs nothing else."""
        from simgap.reports.diagnosis.page import diagnosis_page

        return diagnosis_page(self.findings)

    def __str__(self) -> str:
        from simgap.reports.diagnosis.text import diagnosis_text

        return diagnosis_text(self.findings)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        """In a notebook: the page in a frame of its own."""
        import html

        return f'<iframe style="width:100%;height:900px;border:0" srcdoc="{html.escape(self.to_html())}"></iframe>'
