"""Estimates, fits and changes of a diagnosis as people read them, and words for what is no number."""

from __future__ import annotations

import math

from simgap.findings import Value
from simgap.wording import number, percent, short_exponent


def numbers(value: float, low: float, high: float) -> tuple[str, str, str]:
    """Write an estimate and its interval with as many digits as the interval deserves and the estimate needs.

    6.8432, 6.7112, 6.9743 -> "6.84", "6.71", "6.97".
    """
    half = (high - low) / 2
    if not (math.isfinite(half) and half > 0):
        return number(value), number(low), number(high)
    places = 1 - _size(half)  # two digits of the half width
    # A value much smaller than its interval shows two digits too, unless that takes more than two further ones.
    further = max(places, min(1 - _size(value), places + 2)) if value else places
    return _fixed(value, further), _fixed(low, places), _fixed(high, places)


def fit(percents: float) -> str:
    """Write a fit of 100 (1 - RMSE / standard deviation), 76.04 -> "76.0 %"; there is none for a constant output."""
    if not math.isfinite(percents):
        return "undefined" if math.isnan(percents) else "diverges"
    return f"{percents:.1f} %" if percents <= 99 or percents >= 100 else percent(percents / 100)


def estimate(value: Value) -> str:
    """Write an estimate with its unit: "6.84 mm/s^2"."""
    return f"{numbers(value.value, value.low, value.high)[0]} {value.unit}".rstrip()


def interval(value: Value) -> str:
    """Write an interval, "6.71 to 6.97", and what it is if it is no 95 % interval."""
    if value.low == value.high:
        return "read off the data or at its limit, not estimated"
    if not (math.isfinite(value.low) and math.isfinite(value.high)):
        return "no interval"
    _, low, high = numbers(value.value, value.low, value.high)
    # Parameters of single experiments are summed up: their range is no interval of confidence.
    return f"{low} to {high}" + (" in single experiments" if "over experiments" in value.name else "")


def change(before: float, after: float) -> str:
    """Write a change in percent: 1.2, 0.6 -> "-50 %"."""
    if not (math.isfinite(before) and math.isfinite(after) and before > 0):
        return ""
    share = after / before - 1
    if -1 < share < -0.99:  # "-100 %" would say that nothing is left
        return f"-{percent(-share)}"
    return f"{100 * share:+.0f} %".replace("+0 %", "0 %").replace("-0 %", "0 %")


def share(value: float) -> str:
    """Write one of several shares that add up: 0.6134 -> "61.3 %"."""
    return f"{round(100 * value, 1) + 0.0:.1f} %"  # + 0.0: no minus before a zero


def part(value: float, other: float) -> str:
    """Compute how long a bar for `value` is beside one for `other`, the longer being 1."""
    if not math.isfinite(value):
        return "1"
    return f"{value / max(value, other):.3f}" if math.isfinite(other) and max(value, other) > 0 else "0"


def _size(value: float) -> int:
    return math.floor(math.log10(abs(value)))


def _fixed(value: float, places: int) -> str:
    """Round to that many decimal places, which may be negative; 0 and whole digits stay short."""
    if not math.isfinite(value):
        return f"{value:g}"
    if abs(value) < 0.5 * 10.0**-places:
        return "0"
    size = _size(value)
    if not -4 <= size < 6:
        return short_exponent(f"{value:.{max(size + places, 0)}e}")
    if float(value).is_integer() and abs(value) < 10:
        return f"{value:.0f}"
    return f"{round(value, places):.{max(places, 0)}f}"
