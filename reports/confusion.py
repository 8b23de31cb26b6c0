"""The confusion matrix of the recovery study: what was hidden against what was named."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Row = Mapping[str, Any]
NOTHING, UNEXPLAINED, SUSPECTED = "nothing found", "unexplained", "suspected"


def first_answer(row: Row) -> str:
    """The first name, or what was said instead of one; a confounded pair counts as the truth if that is in it."""
    if row["verdict"] == "named" and row["named"]:
        hidden = row["case"]["effects"]
        return hidden if hidden in row["confounded"][0] else row["named"][0]
    return {"nothing_found": NOTHING, "unexplained": UNEXPLAINED}.get(row["verdict"], row["verdict"])


def matrix(rows: Iterable[Row]) -> dict[str, Counter[str]]:
    """For each single hidden effect that the known-effect reference sees, how often each answer came first."""
    counts: dict[str, Counter[str]] = {}
    for row in rows:
        hidden = row["case"]["effects"]
        if hidden and "," not in hidden and row["visible"]:
            counts.setdefault(hidden, Counter())[first_answer(row)] += 1
    return counts


def summary(rows: Sequence[Row], right: Sequence[bool]) -> list[tuple[str, str]]:
    """The figures that matter, each with its number of cases."""
    pairs = [(r, ok) for r, ok in zip(rows, right, strict=True) if r["status"] == "ok"]
    lines = []

    def rate(label: str, chosen: list[tuple[Row, bool]]) -> None:
        if chosen:
            count = sum(ok for _, ok in chosen)
            lines.append((label, f"{count} of {len(chosen)} ({100 * count / len(chosen):.1f} %)"))

    single = [(r, ok) for r, ok in pairs if r["case"]["effects"] and "," not in r["case"]["effects"]]
    inside = [(r, ok) for r, ok in single if r["reference_ratio"] is not None]
    seen = [(r, ok) for r, ok in inside if r["visible"]]
    rate("first name right, of the effects that the known-effect reference sees", seen)
    for key in ("strength", "noise", "rig"):
        for value in sorted({r["case"][key] for r, _ in seen}, key=str):
            rate(f"  {key} {value}", [(r, ok) for r, ok in seen if r["case"][key] == value])
    both = [(r, ok) for r, ok in pairs if "," in r["case"]["effects"]]
    rate("both of two effects named", [(r, ok) for r, ok in both if r["visible"]])
    rate("nothing named where nothing is hidden", [(r, ok) for r, ok in pairs if not r["case"]["effects"]])
    rate("unexplained, where the effect is in no catalogue", [(r, ok) for r, ok in single if (r, ok) not in inside])
    gains = [r["gain"] / r["reference_gain"] for r, _ in seen if r["reference_gain"] > 0]
    if gains:
        lines.append(("gain recovered, of what the reference gains (median)", f"{100 * median(gains):.1f} %"))
    lines.append(("not visible to the reference, left out", str(len(inside) - len(seen))))
    if len(pairs) < len(rows):
        lines.append(("failed, left out", str(len(rows) - len(pairs))))
    return lines


def picture(rows: Sequence[Row], file: Path) -> None:
    """The matrix as a picture in a file, PNG by its ending."""
    drawn(matrix(rows)).savefig(file)


def drawn(counts: Mapping[str, Counter[str]]) -> Figure:
    """The matrix: rows what was hidden, columns what was named first, in percent of the visible cases."""
    from matplotlib.figure import Figure

    hidden = sorted(counts)
    answers = sorted({name for counter in counts.values() for name in counter} - {SUSPECTED, NOTHING, UNEXPLAINED})
    answers += [SUSPECTED, NOTHING, UNEXPLAINED]
    figure = Figure(figsize=(4 + 0.42 * len(answers), 2.6 + 0.34 * len(hidden)), layout="constrained")
    axes = figure.add_subplot()
    shares = [[100 * counts[h][a] / counts[h].total() for a in answers] for h in hidden]
    axes.imshow(shares, cmap="Blues", vmin=0, vmax=100, aspect="auto")
    for i, name in enumerate(hidden):
        for j, answer in enumerate(answers):
            if counts[name][answer]:
                colour = "white" if shares[i][j] > 55 else "black"
                axes.text(j, i, str(counts[name][answer]), ha="center", va="center", color=colour, fontsize=8)
    axes.set_xticks(range(len(answers)), [a.replace("_", " ") for a in answers], rotation=60, ha="right", fontsize=8)
    axes.set_yticks(range(len(hidden)), [f"{h.replace('_', ' ')} ({counts[h].total()})" for h in hidden], fontsize=8)
    axes.set_xlabel("named first")
    axes.set_ylabel("hidden (cases that the reference sees)")
    return figure
