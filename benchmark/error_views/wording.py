"""What a simulation does wrong, and where, as people say it."""

from __future__ import annotations

import math

from simgap.wording import amount, number

DIGITS = 2  # of an error, which a mean over the samples of a bin knows no better


def error(value: float, unit: str) -> str:
    """Write the size of an error with its unit: 2.53, "deg" -> "2.5 deg"."""
    return amount(value, unit, DIGITS)


def mean_error(mean: float, unit: str) -> str:
    """Say how far off a simulation is whose mean error is y - y_hat: 0.8, "deg" -> "0.8 deg too low"."""
    return f"{error(abs(mean), unit)} too {'low' if mean > 0 else 'high'}" if mean else "right on average"


def between(low: float, high: float, unit: str) -> str:
    """Say which range [low, high) is meant, of which an end may be infinite: "between 1.2 and 3.1 V", "below 3 V"."""
    ends = number(low) if math.isfinite(low) else "", number(high) if math.isfinite(high) else ""
    if not ends[0]:
        return f"below {ends[1]} {unit}".rstrip()
    if not ends[1]:
        return f"above {ends[0]} {unit}".rstrip()
    return (f"near {ends[0]} {unit}" if ends[0] == ends[1] else f"between {ends[0]} and {ends[1]} {unit}").rstrip()


def span(low: float, high: float) -> str:
    """Say which range of time is meant, in seconds: "up to 0.7 s", "0.7 to 1.5 s", "more than 1.5 s"."""
    if not math.isfinite(low):
        return f"up to {number(high, 2)} s"
    return f"{number(low, 2)} to {number(high, 2)} s" if math.isfinite(high) else f"more than {number(low, 2)} s"


def rate(unit: str) -> str:
    """Give the unit of a change per second: "deg" -> "deg/s", "deg/s" -> "deg/s²", "" -> "1/s"."""
    return f"{unit}²" if unit.endswith("/s") else f"{unit or 1}/s"
