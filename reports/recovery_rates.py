"""Rates of the recovery benchmark as tables, each with its 95 % interval."""

from __future__ import annotations

from collections.abc import Mapping
from math import sqrt
from typing import Any

from simgap.reports.tables import Cell, Table
from simgap.wording import number

Z = 1.959964  # of 95 %
RIGHT = {
    "first_right": "first name right",
    "among_first": "truth in first cause",
    "only_suspected": "truth only suspected",
    "wrong_name": "some name wrong",
    "both_of_pair": "both of two named",
}
INVENTED = {
    "invented_on_clean": "named where nothing is hidden",
    "invented_outside": "named for an unlisted effect",
}


def rate_tables(scored: Mapping[str, Any]) -> list[Table]:
    """Lay out what `simgap recovery score` counts: right names, invented names with failures and seconds, by effect."""
    tools = scored["tools"]
    counts = next(iter(tools.values()))
    right = [
        [Cell(tool), *(_cell(rates[key]) for key in RIGHT), Cell(_number(rates["names_per_first"]))]
        for tool, rates in tools.items()
    ]
    invented = [
        [
            Cell(tool),
            *(_cell(rates[key]) for key in INVENTED),
            Cell(str(rates["failed"][0])),
            Cell(_number(rates["median_seconds"])),
            Cell(_number(rates["longest_seconds"])),
        ]
        for tool, rates in tools.items()
    ]
    by_effect = [
        [Cell(f"{effect} ({total})"), *(Cell(str(rates["by_effect"][effect][0])) for rates in tools.values())]
        for effect, (_, total) in counts["by_effect"].items()
    ]
    of_right = [
        f"Seed {scored['seed']}: cases with one effect {counts['first_right'][1]}, with two "
        f"{counts['both_of_pair'][1]}. In brackets: the 95 % interval (Wilson 1927). A case that a tool fails on "
        "counts as not right.",
        "A tool may give several names as one cause, among which it does not decide; the first is its first name, and "
        "the last column says how many names its first causes hold.",
    ]
    of_invented = [
        f"Cases with nothing hidden: {counts['invented_on_clean'][1]}; with an effect that is not on the list: "
        f"{counts['invented_outside'][1]}. Failures and seconds are those of all {scored['cases']} cases."
    ]
    failures = [f"{tool}: {n} x {reason}" for tool, rates in tools.items() for reason, n in rates["failures"].items()]
    return [
        Table("Right names", ["tool", *RIGHT.values(), "names in first cause"], right, of_right),
        Table(
            "Invented names, failures and seconds",
            ["tool", *INVENTED.values(), "failed", "median s", "longest s"], invented, of_invented + failures,
        ),
        Table("First name right by effect", ["hidden", *tools], by_effect, ["In brackets: the number of cases."]),
    ]  # fmt: skip


def wilson(right: int, total: int) -> tuple[float, float]:
    """95 % interval of a rate (Wilson 1927): (p + z^2/2n +- z sqrt(p (1-p)/n + z^2/4n^2)) / (1 + z^2/n)."""
    share, extra = right / total, Z**2 / total
    half = Z * sqrt(share * (1 - share) / total + extra / (4 * total))
    return max(0.0, (share + extra / 2 - half) / (1 + extra)), min(1.0, (share + extra / 2 + half) / (1 + extra))


def _cell(rate: list[int]) -> Cell:
    right, total = rate
    if not total:
        return Cell("")
    low, high = wilson(right, total)
    return Cell(f"{100 * right / total:.0f} % ({100 * low:.0f} to {100 * high:.0f})", right / total)


def _number(value: float | int | None) -> str:
    return "" if value is None else number(float(value), 2)
