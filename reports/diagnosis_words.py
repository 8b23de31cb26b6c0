"""What the text and the page of a diagnosis have in common: numbers, the headline, and which views to show."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from simgap.findings import Cause, Findings, Value, Wrong

CHANCE = 0.01  # views that chance explains as often are not shown
LAST = "frequency band"  # says where the error is, but nothing about its cause: shown only for want of others
# Words by which effects name views that have other names, or several. "input" and "position" take a channel's name.
ALIASES = {
    "time": ("time since the start",),
    "frequency": (LAST,),
    "first against second half": ("drift within experiment",),
    "position": ("position", "value", "level"),
    "velocity": ("velocity", "rate of change"),
}


def number(value: float, digits: int = 3) -> str:
    """0.012345 -> "0.0123", 12345.6 -> "12346": `digits` significant ones, but never rounded before the point."""
    if not math.isfinite(value) or value == 0:
        return f"{value:g}"
    return _fixed(value, max(digits - 1 - _size(value), 0))


def numbers(value: float, low: float, high: float) -> tuple[str, str, str]:
    """An estimate and the ends of its interval, with as many digits as the interval deserves and the estimate needs.

    6.8432, 6.7112, 6.9743 -> "6.84", "6.71", "6.97".
    """
    half = (high - low) / 2
    if not (math.isfinite(half) and half > 0):
        return number(value), number(low), number(high)
    places = 1 - _size(half)  # two digits of the half width
    if value:
        # A value much smaller than its interval shows two digits too, unless that takes more than two further ones.
        places = max(places, min(1 - _size(value), places + 2))
    return _fixed(value, places), _fixed(low, places), _fixed(high, places)


def percent(share: float) -> str:
    """0.613 -> "61 %", 0.9968 -> "99.7 %": what lacks to 100 % shows."""
    percents = 100 * share
    if not math.isfinite(percents):
        return "an unknown share"
    if 0 < abs(percents) < 1:
        return "less than 1 %"
    places = -_size(100 - percents) if 99 < percents < 100 else 0
    return f"{percents:.{min(max(places, 0), 6)}f} %"


def amount(value: float, unit: str, digits: int = 3) -> str:
    """2.5, "deg" -> "2.5 deg"."""
    return f"{number(value, digits)} {unit}".rstrip() if math.isfinite(value) else "diverges"


def fit(percents: float) -> str:
    """A fit of 100 (1 - RMSE / standard deviation): 76.04 -> "76.0 %"."""
    if not math.isfinite(percents):
        return "diverges"
    return f"{percents:.1f} %" if percents <= 99 or percents >= 100 else percent(percents / 100)


def interval(value: Value) -> str:
    """ "6.71 to 6.97", with what else it is than a 95 % interval."""
    if value.low == value.high:
        return "read off the data, not estimated"
    if not (math.isfinite(value.low) and math.isfinite(value.high)):
        return "no interval"
    _, low, high = numbers(value.value, value.low, value.high)
    # Parameters of single experiments are summed up: their range is no interval of confidence.
    return f"{low} to {high}" + (" in single experiments" if "over experiments" in value.name else "")


def estimate(value: Value) -> str:
    """ "6.84 mm/s^2"."""
    return f"{numbers(value.value, value.low, value.high)[0]} {value.unit}".rstrip()


def headline(findings: Findings) -> str:
    """The verdict in a sentence."""
    gain = findings.gain
    if findings.verdict == "nothing_found":
        return (
            "Nothing found: no effect of the catalogue makes the plain linear model simulate these data better, and "
            "the input predicts hardly anything more of its error."
        )
    if findings.verdict == "unexplained":
        return (
            "Something is there, but nothing in the catalogue explains it: "
            f"{percent(findings.left)} of the squared error could still be predicted from the input."
        )
    names = [named(cause, findings) for cause in findings.causes]
    listed = " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
    them, size = "it" if len(names) == 1 else "them", abs(gain.share)
    start = f"The simulation errs because of {listed}; with {them} the free-run error on the test experiments"
    if not math.isfinite(gain.share):
        return f"{start} cannot be compared, because a simulation diverges."
    return f"{start} {'falls' if gain.share >= 0 else 'rises'} by {percent(size)}{_range(findings)}."


def named(cause: Cause, findings: Findings) -> str:
    """The title, with the channel where there are several to choose from."""
    several = len(findings.inputs) > 1 or len(findings.units) > 1
    return f"{cause.title} ({cause.channel})" if cause.channel and several else cause.title


def evidence(cause: Cause) -> str:
    """What the effect explains, in training and held out, in one or two sentences."""
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
    return (
        f"It explains {percent(cause.evidence)} of the plain model's squared error in training (log-likelihood ratio "
        f"{number(cause.log_likelihood_ratio)}); {held_out}.{remark}"
    )


def runner_up(findings: Findings) -> str:
    """The best effect that was not named, in a sentence; empty without one."""
    second = findings.runner_up
    if not second:
        return ""
    gain, margin = second.get("gain"), second.get("margin")
    told = f"{second.get('title') or second.get('effect')}"
    if gain is not None:
        told += f"; by itself it would make the held-out squared error {percent(gain)} smaller"
    return told + (f", {number(margin)} behind in log-likelihood." if margin is not None else ".")


def telling(findings: Findings) -> list[Wrong]:
    """The views that chance does not explain, the one with the largest share first, the least telling ones last."""
    views = [view for view in findings.wrong if view.chance < CHANCE]
    return sorted(views, key=lambda view: (view.view == LAST, -view.share))


def shows(view: Wrong, cause: Cause) -> bool:
    """Whether a view is one of those that show the effect."""
    for name in cause.shows_in:
        for alias in ALIASES.get(name, (name,)):
            channel = alias in ("input", "position") and view.view.startswith(f"{alias} ")
            if view.view == alias or channel:
                return True
    return False


def change(before: float, after: float) -> str:
    """1.2, 0.6 -> "-50 %"."""
    if not (math.isfinite(before) and math.isfinite(after) and before > 0):
        return ""
    return f"{100 * (after / before - 1):+.0f} %".replace("+0 %", "0 %").replace("-0 %", "0 %")


def shortened(text: str, longest: int = 40) -> str:
    """Names that leave room for the plot they label."""
    return text if len(text) <= longest else text[: longest - 1] + "…"


def orders(order: object) -> str:
    """2 -> "2"; [2, 1] -> "2, 1", one per plant."""
    return ", ".join(map(str, order)) if isinstance(order, Sequence) and not isinstance(order, str) else str(order)


def _range(findings: Findings) -> str:
    low, high = sorted(math.copysign(100, findings.gain.share) * end for end in (findings.gain.low, findings.gain.high))
    if not (math.isfinite(low) and math.isfinite(high)):
        return ""
    places = 0 if high - low > 2 else 1
    return f" ({low:.{places}f} to {high:.{places}f} %)"


def _size(value: float) -> int:
    return math.floor(math.log10(abs(value)))


def _fixed(value: float, places: int) -> str:
    """`value` rounded to that many decimal places, which may be negative; zero and one stay short."""
    if value == 0 or not math.isfinite(value):
        return f"{value:g}"
    size = _size(value)
    if not -4 <= size < 6:
        return re.sub(r"e([+-])0*", r"e\1", f"{value:.{max(size + places, 0)}e}").replace("e+", "e")
    if float(value).is_integer() and abs(value) < 10:
        return f"{value:.0f}"
    return f"{round(value, places):.{max(places, 0)}f}"
