"""A comparison with a reference as Markdown, for a pull request."""

from __future__ import annotations

import math
from collections.abc import Sequence

from simgap.reports.rendering import to_markdown
from simgap.reports.tables import Cell, Table
from simgap.results.regression import Comparison, Regression

HEADINGS = ["model", "data set", "figure", "seed", "before", "after", "limit", "verdict"]
# Rows of what went wrong; the rest is counted.
MOST = 40


def to_text(regression: Regression) -> str:
    """Verdict, what is worse or missing with before, after and limit, and one line per model, worst first."""
    wrong = regression.wrong
    counts = {name: sum(one.verdict == name for one in regression.comparisons) for name in ("worse", "missing")}
    total = len(regression.comparisons)
    if wrong:
        head = f"**simgap check: {counts['worse']} worse and {counts['missing']} missing of {total} figures**"
    else:
        head = f"**simgap check: none of {total} figures is worse or missing**"
    parts = [head + "\n", *(f"{note}\n" for note in regression.notes)]
    if wrong:
        shown = sorted(wrong, key=_excess, reverse=True)[:MOST]
        rest = [f"{len(wrong) - MOST} more are not shown."] if len(wrong) > MOST else []
        parts.append(to_markdown(Table("Worse or missing", HEADINGS, [_cells(one) for one in shown], rest), 3))
    parts += ["<details><summary>The nearest to its limit of each model</summary>\n"]
    parts.append(to_markdown(Table("All models", HEADINGS, [_cells(one) for one in _nearest(regression)]), 3))
    parts.append("</details>\n")
    return "\n".join(parts)


def _cells(one: Comparison) -> list[Cell]:
    verdict = f"{one.verdict}: {one.why}" if one.why else one.verdict
    seed = "" if one.seed is None else str(one.seed)
    figures = [_number(one.before), _number(one.after), _number(one.limit)]
    return [Cell(text) for text in (one.model, one.dataset, one.figure, seed, *figures, verdict)]


def _number(value: float | None) -> str:
    """Nine digits, because limits may be as near as 1e-6."""
    return "" if value is None else f"{value:.9g}"


def _excess(one: Comparison) -> float:
    """How near to its limit a figure is: 1 at the limit; what is missing comes first."""
    if one.before is None or one.after is None:
        return math.inf
    if one.after == one.before or not math.isfinite(one.before):
        return 0.0 if one.after <= one.before else math.inf
    return (one.after - one.before) / max(one.limit - one.before, 1e-300)


def _nearest(regression: Regression) -> Sequence[Comparison]:
    worst: dict[tuple[str, str, str], Comparison] = {}
    for one in regression.comparisons:
        group = one.suite, one.model, one.dataset
        if group not in worst or _excess(one) > _excess(worst[group]):
            worst[group] = one
    return sorted(worst.values(), key=_excess, reverse=True)
