"""The answer of a diagnosis as the short text that `simgap diagnose` prints."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from typing import Any

from simgap.findings import Budget, Cause, Findings
from simgap.reports.diagnosis import numbers, their_simulation, words
from simgap.reports.rendering import printable
from simgap.wording import amount, percent

VIEWS = 3  # of what is wrong; the page shows all


def diagnosis_text(findings: Findings, width: int = 100) -> str:
    """Write the answer in lines of at most `width` characters that a control engineer can act on.

    Names from data sets are shown, never obeyed: what a terminal would interpret is left out.
    """
    paragraphs = [
        *_wrapped(f"{findings.dataset}: {words.headline(findings)}", width),
        *_section(*_diagnosed(findings), width),
        *_section("Best linear model", list(_linear(findings.linear, findings)) if findings.linear else [], width),
        *_section("What it gets wrong", _wrong(findings), width),
    ]
    for called, causes in (("Cause", findings.causes), ("Suspect", findings.suspects)):
        for i, cause in enumerate(causes, start=1):
            title = f"{called} {i}: {words.cause_title(cause, findings)}"
            paragraphs += _section(title, _cause(cause, findings), width)
    paragraphs += _section("Linear part", their_simulation.linear_part(findings), width)
    if second := words.runner_up(findings):
        paragraphs += _section("Runner-up", [second], width)
    if findings.effects or (findings.simulation and findings.simulation.linear_differs):
        title = "Free-run RMSE on the test experiments" + (
            ", with the suspects" if findings.suspects and not findings.causes else ""
        )
        paragraphs += _section(title, _gain(findings), width)
    for budget in findings.budget:
        owner = their_simulation.owner_of(findings)
        title = f"Where the squared error of {budget.output} goes: shares of {owner} on the test experiments"
        paragraphs += _section(title, _budget(budget, findings), width)
        if budget.mean_absolute_errors:
            title = f"Mean absolute error of {budget.output} on the test experiments, each cause beside those before it"
            paragraphs += _section(title, _absolute(budget, findings), width)
    for offer in findings.offers:
        formula = f"missing force of {offer.output} ({offer.unit}): {offer.formula}"
        share = f"explains {percent(offer.explained)} of the squared error of {offer.output} that is left in training"
        paragraphs += _section("An offer to look at, not a finding", [formula, share], width)
    paragraphs += _section("About the data", findings.checks, width)
    if findings.effects:
        paragraphs += ["", *_wrapped(words.of_numbers(findings), width)]
    return "\n".join(paragraphs) + "\n"


def _section(title: str, items: Iterator[str] | list[str] | tuple[str, ...], width: int) -> list[str]:
    lines = [line for item in items for line in _wrapped(item, width, "  ")]
    return ["", *_wrapped(title, width), *lines] if lines else []


def _wrapped(text: str, width: int, indent: str = "") -> list[str]:
    """Wrap an item, its further lines indented, so that one sees where it begins."""
    return textwrap.wrap(
        printable(text), max(width, 20), initial_indent=indent, subsequent_indent=2 * indent, break_on_hyphens=False
    )


def _diagnosed(findings: Findings) -> tuple[str, Iterator[str]]:
    """Describe the model whose error is diagnosed."""
    if findings.simulation:
        return "Your simulation", their_simulation.errors(findings)
    return "Plain linear model", _linear(findings.baseline, findings)


def _linear(model: dict[str, Any], findings: Findings) -> Iterator[str]:
    yield f"order {words.orders(model.get('order', 'unknown'))}"
    for name, rmse in model.get("rmse", {}).items():
        percents = model.get("fit_percent", {}).get(name, float("nan"))
        remark = ": the mean is a better guess" if percents < 0 else ""
        yield f"{name}: free-run RMSE {amount(rmse, findings.units.get(name, ''))}, fit {numbers.fit(percents)}{remark}"


def _wrong(findings: Findings) -> list[str]:
    views = words.beyond_chance(findings)
    shown = [view for view in views if view.view != words.LAST][:VIEWS] or views[:1]
    return [view.text for view in shown] or ["No view of its error shows more than chance does."]


def _cause(cause: Cause, findings: Findings) -> Iterator[str]:
    yield cause.text
    for parameter in cause.parameters:
        value = f"{parameter.name} = {numbers.estimate(parameter)} ({numbers.interval(parameter)})"
        yield value + their_simulation.simulated(cause, parameter)
    yield words.evidence(cause)
    for other in cause.confounded_with:
        yield f"These data do not tell it from {other.title} - to separate them: {other.experiment.rstrip('.')}."
    if decide := words.deciding(cause, findings):
        yield decide


def _absolute(budget: Budget, findings: Findings) -> list[str]:
    """List the mean absolute error of a known machine with ever more of its causes."""
    unit, titles = findings.units[budget.output], words.titles_of(findings, budget.output)
    milli = unit in ("rad", "m")
    return [
        f"{value * (1000 if milli else 1):6.3g} {'m' * milli}{unit}  "
        + (f"with {titles.get(name, name)}" if name else "plain model with what is known")
        for name, value in budget.mean_absolute_errors.items()
    ]


def _budget(budget: Budget, findings: Findings) -> list[str]:
    rows = [(numbers.share(share), part) for part, share in words.parts_of(budget, findings) if share is not None]
    return [f"{share:>8}  {part}" for share, part in rows]


def _gain(findings: Findings) -> Iterator[str]:
    gain = findings.gain
    for name, before in gain.before.items():
        after, unit = gain.after.get(name, float("nan")), findings.units.get(name, "")
        change = numbers.change(before, after)
        line = f"{name}: {amount(before, '')} -> {amount(after, unit)}"
        yield f"{line} ({change})" if change else line
    if findings.left > 0.01:
        yield f"{percent(findings.left)} of the plain model's squared error can still be learned from the input."
