"""What the text and the page of a diagnosis have in common: the headline, sentences, and which views to show."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from simgap.error_views.wrong import Wrong
from simgap.findings import Budget, Cause, Findings
from simgap.reports.diagnosis import their_simulation
from simgap.wording import number, percent

CHANCE = 0.01  # views that chance explains as often are not shown
WIDE = 10.0  # of the error: no interval that says anything
LAST = "frequency band"  # says where the error is, but nothing about its cause: shown only for want of others


def headline(findings: Findings) -> str:
    """Say the verdict in a sentence."""
    gain = findings.gain
    if findings.doubts:
        return f"Nothing is named. {findings.doubts[0]}"
    if findings.verdict == "nothing_found":
        return their_simulation.nothing_found(findings)
    if findings.verdict == "unexplained":
        return (
            "Something is there, but nothing in the catalogue explains it: "
            f"{percent(findings.left)} of the squared error can still be learned from the input."
        )
    listed, several = _listed(findings.effects, findings, told_apart=True), len(findings.effects) > 1
    them = "them" if several else "it"
    if math.isfinite(gain.share):
        change = f"{'falls' if gain.share >= 0 else 'rises'} by {percent(abs(gain.share))}{_range(findings)}"
    else:
        change = "cannot be compared, because a simulation diverges"
    if findings.verdict == "suspected":
        asked = f"Nothing is named. The training data ask for {listed}"
        if gain.share > 0:
            asked = f"Suspected, not shown: {listed}. The training data ask for {them}"
        return f"{asked}, but {_not_shown(findings)} {change}."
    whose, corrected = ("Your", "corrected,") if findings.simulation else ("The", f"with {them}")
    wrong_numbers = findings.simulation is not None and findings.simulation.linear_differs
    listed += ", and of wrong parameters of its linear part" * wrong_numbers
    said = (
        f"{whose} simulation errs because of {listed}; {corrected} the free-run error on the test experiments {change}."
    )
    if not findings.suspects:
        return said
    return f"{said} Suspected besides, not shown: {_listed(findings.suspects, findings)}."


def _not_shown(findings: Findings) -> str:
    """Say what the test experiments have against the suspects, up to how the error changes with them."""
    gain, several = findings.gain, len(findings.effects) > 1
    them = "them" if several else "it"
    if gain.low > 0:
        return (
            f"with {them} the simulation still errs more on the test experiments than their mean would: "
            "the free-run error"
        )
    helps = "they help" if several else "it helps"
    says = f"speak against {them}" if gain.high < 0 else f"do not show that {helps}"
    return f"the test experiments {says}: with {them} the free-run error"


def _listed(causes: Sequence[Cause], findings: Findings, told_apart: bool = False) -> str:
    names = [cause_title(cause, findings) + _or_others(cause) * told_apart for cause in causes]
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def _or_others(cause: Cause) -> str:
    """Name what the data do not tell from a cause."""
    return f" (or {' or '.join(other.title for other in cause.confounded_with)})" if cause.confounded_with else ""


def cause_title(cause: Cause, findings: Findings) -> str:
    """Name a cause by its title, with the channel, and the output of its plant, where there are several to choose from.

    Coulomb friction (position); input saturation (valve, in flow).
    """
    several = len(findings.inputs) > 1 or len(findings.units) > 1
    places = [cause.channel] if cause.channel and several else []
    if cause.output and cause.output != cause.channel:
        places.append(f"in {cause.output}")
    return f"{cause.title} ({', '.join(places)})" if places else cause.title


def evidence(cause: Cause) -> str:
    """Say what the effect explains, in training and held out, in one or two sentences."""
    if cause.holds:
        return their_simulation.evidence(cause)
    held_out = (
        f"on held-out data the squared error is {percent(cause.gain)} smaller with it than without"
        if cause.gain > 0
        else "on held-out data the squared error is no smaller with it than without"
    )
    remark = (
        " It belongs to one experiment and cannot be forecast: this is measured with the parameter estimated anew."
        if cause.per_experiment
        else ""
    )
    ratio = number(cause.log_likelihood_ratio)
    likely = (
        f" (log-likelihood ratio {ratio})"
        if cause.log_likelihood_ratio > 0
        else f", but only of free runs: the one-step errors are no likelier with it (log-likelihood ratio {ratio})"
    )
    explained = f"It explains {percent(cause.evidence)} of the plain model's squared error in training{likely}"
    if cause.effect == "outliers":
        return f"{explained}. They are left out of all data."
    return f"{explained}; {held_out}.{remark}"


def deciding(cause: Cause, findings: Findings) -> str:
    """Say what to record to decide about a suspect; empty for a cause, and where its confounders say it already."""
    if cause not in findings.suspects or cause.confounded_with or not cause.deciding_experiment:
        return ""
    return f"To decide: {cause.deciding_experiment.rstrip('.')}."


def with_effects(findings: Findings) -> str:
    """Name the model that the gain is of: with the causes, or with the suspects."""
    if findings.simulation:
        return "corrected"
    return "with the suspects" if findings.verdict == "suspected" else "with the causes"


def of_numbers(findings: Findings) -> str:
    """Say what ranges are, and what forces are in the units of accelerations."""
    units = [parameter.unit for cause in findings.effects for parameter in cause.parameters]
    per_mass = " Forces are per unit of mass or inertia, which these records do not tell."
    ranges = "Ranges in brackets are 95 % intervals where nothing else is said."
    of_motion = {"position", "velocity"} & set(findings.kinds.values())
    return ranges + per_mass * (bool(of_motion) and any(unit.endswith("/s^2") for unit in units))


def runner_up(findings: Findings) -> str:
    """Say in a sentence which effect was the best that was not named; empty without one."""
    second = findings.runner_up
    if not second:
        return ""
    gain, margin = second.get("gain"), second.get("margin")
    told = f"{second.get('title') or second.get('effect')}"
    if gain is not None:
        change = "larger" if gain < 0 else "smaller"
        told += f"; by itself it would make the held-out squared error {percent(abs(gain))} {change}"
    if margin is None:
        return f"{told}."
    place = "behind" if margin >= 0 else "ahead of"
    return (
        f"{told}. By the log-likelihood of training and held-out data, less what its parameters cost, it is "
        f"{number(abs(margin))} {place} the best of the causes by itself."
    )


def titles_of(findings: Findings, output: str) -> dict[str, str]:
    """Map the names of causes in an output's budget to their titles."""
    causes = [replace(cause, output="") for cause in findings.causes if cause.output in ("", output)]
    titles = {cause.effect: cause_title(cause, findings) for cause in causes}
    titles["linear_part"] = "parameters of the linear part"
    return titles | {f"{cause.effect}:{cause.channel}": f"{cause.title} ({cause.channel})" for cause in causes}


def parts_of(budget: Budget, findings: Findings) -> list[tuple[str, float | None]]:
    """List the parts of an error budget with their shares: the causes, then what is left; empty where there is none."""
    if not math.isfinite(budget.unexplained):
        return []
    titles = titles_of(findings, budget.output)
    return [
        *((titles.get(name, name), share) for name, share in budget.causes.items()),
        ("learnable from the input, without a name", budget.learnable),
        ("floor: what repeated runs differ by", budget.floor),
        ("unexplained" if budget.floor is not None else "unexplained, or noise: there are no repeated runs",
         budget.unexplained),
    ]  # fmt: skip


def beyond_chance(findings: Findings) -> list[Wrong]:
    """List the views that chance does not explain, the largest share first, the frequency band last."""
    views = [view for view in findings.wrong if view.chance < CHANCE]
    return sorted(views, key=lambda view: (view.view == LAST, -view.share))


def shows(view: Wrong, cause: Cause) -> bool:
    """Tell whether a view is one of those that show the effect."""
    return view.view in cause.shows_in


def orders(order: object) -> str:
    """List the order of each plant: 2 -> "2"; [2, 1] -> "2, 1"."""
    return ", ".join(map(str, order)) if isinstance(order, Sequence) and not isinstance(order, str) else str(order)


def shorten(text: str, longest: int = 32) -> str:
    """Shorten a name so that it leaves room for the plot it labels."""
    return text if len(text) <= longest else text[: longest - 1] + "…"


def capitalise(text: str) -> str:
    """Begin a text with a capital letter."""
    return text[:1].upper() + text[1:]


def _range(findings: Findings) -> str:
    gain = findings.gain
    pieces = gain.in_pieces
    if pieces is not None and gain.shown:
        percents = _in_percent(pieces.low, pieces.high)
        return f", and by {percent(pieces.share)}{percents} in free runs of {pieces.samples} samples each"
    low, high = sorted(math.copysign(1, gain.share) * end for end in (gain.low, gain.high))
    if not (math.isfinite(low) and math.isfinite(high)):
        return ""
    if high - low > WIDE:
        return ", in too few independent samples for an interval"
    return _in_percent(low, high)


def _in_percent(low: float, high: float) -> str:
    places = 0 if high - low > 0.02 else 1
    return f" ({100 * low:.{places}f} to {100 * high:.{places}f} %)"
