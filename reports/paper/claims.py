"""The paper's claims as a checklist on results of the suite `paper`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Literal

from simgap.records import Result
from simgap.reports.paper.claim_rules import RULES, Figures, Rule, Undecided
from simgap.reports.paper.tables import (
    LABELS,
    PRINTED,
    SPOKEN_OF,
    Values,
    rows_by_label,
    values_by_condition,
    values_by_seed,
)
from simgap.reports.tables import Cell, Table

Judgement = Literal["holds", "does not hold", "cannot be told"]


@dataclass(frozen=True)
class Claim:
    """One claim of the paper: where it stands, what our figures say to it and which figures those are.

    `printed` is the judgement of the same rule on the figures that the paper prints.
    """

    text: str
    section: str
    judgement: Judgement
    evidence: str
    printed: Judgement
    rule: str


def claims(results: Sequence[Result], crossover: Sequence[Result] = ()) -> list[Claim]:
    """Decide all claims: one holds, or does not, if the medians over the seeds say so and so do most of the seeds.

    Some are about conditions that only rows of the suite `crossover` have.
    """
    rows_of = rows_by_label(results, (*LABELS, *SPOKEN_OF))
    by_label = {label: values_by_seed(rows) for label, rows in rows_of.items()} | values_by_condition(crossover)
    seeds = sorted({seed for found in by_label.values() for seed in found})
    medians = Figures({label: _medians(list(found.values())) for label, found in by_label.items()})
    single = [Figures({label: found.get(seed, {}) for label, found in by_label.items()}) for seed in seeds]
    printed = Figures(_printed())
    found = []
    for text, section, rule in RULES:
        judgement, evidence = _decide(rule, medians, single)
        on_paper, _ = _decide(rule, printed, [printed])
        found.append(Claim(text, section, judgement, evidence, on_paper, " ".join((rule.__doc__ or "").split())))
    return found


def claims_table(found: Sequence[Claim]) -> Table:
    """Make the checklist, with the rules as footnotes."""
    rules = list(dict.fromkeys(claim.rule for claim in found))
    rows = [
        [
            Cell(f"{claim.text} [{rules.index(claim.rule) + 1}]"), Cell(claim.section), Cell(claim.judgement),
            Cell(claim.evidence), Cell(claim.printed),
        ]
        for claim in found
    ]  # fmt: skip
    about = (
        "The claims are those of sections 3.9 and 4, in our words. The last column is the judgement of the same rule "
        "on the figures that the paper prints, which stand for one seed."
    )
    columns = ["claim", "section", "judgement", "evidence", "the paper's figures"]
    return Table("The paper's claims", columns, rows, [*rules, about])


def _decide(rule: Rule, medians: Figures, seeds: Sequence[Figures]) -> tuple[Judgement, str]:
    try:
        holds, evidence = rule(medians)
    except Undecided as why:
        return "cannot be told", str(why)
    votes = [vote for seed in seeds if (vote := _vote(rule, seed)) is not None]
    agree = votes.count(holds)
    if len(votes) != 1:
        evidence += f"; {agree} of {len(votes)} seeds agree"
    if 2 * agree <= len(votes):
        return "cannot be told", evidence
    return "holds" if holds else "does not hold", evidence


def _vote(rule: Rule, seed: Figures) -> bool | None:
    """Decide a claim by one seed; None where it lacks figures."""
    try:
        return rule(seed)[0]
    except Undecided:
        return None


def _medians(found: Sequence[Values]) -> Values:
    columns = {column for values in found for column in values}
    return {column: median([values[column] for values in found if column in values]) for column in columns}


def _printed() -> dict[str, Values]:
    """Collect what the paper prints of each model, all tables together."""
    labels = {label for table in PRINTED for label in table.rows}
    return {k: {c: v for table in PRINTED for c, v in table.rows.get(k, {}).items()} for k in labels}
