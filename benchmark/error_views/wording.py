"""Numbers with units, and what a simulation does wrong there, as people say it."""

from __future__ import annotations

import math


def number(value: float, digits: int = 2) -> str:
    """0.0123 -> "0.012", 2.50 -> "2.5", 1234.5 -> "1234": rounded to `digits`, but never before the decimal point."""
    if value == 0:
        return "0"
    before = math.floor(math.log10(abs(value))) + 1
    return f"{float(f'{value:.{max(digits, min(before, 6))}g}'):.{max(digits, 6)}g}"


def amount(value: float, unit: str, digits: int = 2) -> str:
    """2.5, "deg" -> "2.5 deg"."""
    return f"{number(value, digits)} {unit}".rstrip()


def percent(share: float) -> str:
    """0.613 -> "61 %"."""
    return "less than 1 %" if 0 < share < 0.01 else f"{100 * share:.0f} %"


def off(error: float, unit: str) -> str:
    """How far off a simulation is whose mean error y - y_hat is `error`: 0.8, "deg" -> "0.8 deg too low"."""
    return f"{amount(abs(error), unit)} too {'low' if error > 0 else 'high'}" if error else "right on average"


def between(low: float, high: float, unit: str) -> str:
    """The range [low, high), either end of which may be infinite: "above 3.1 V", "between 1.2 and 3.1 V"."""
    ends = number(low, 3) if math.isfinite(low) else "", number(high, 3) if math.isfinite(high) else ""
    if not ends[0]:
        return f"below {ends[1]} {unit}".rstrip()
    if not ends[1]:
        return f"above {ends[0]} {unit}".rstrip()
    return (f"near {ends[0]} {unit}" if ends[0] == ends[1] else f"between {ends[0]} and {ends[1]} {unit}").rstrip()


def span(low: float, high: float) -> str:
    """The same for a time in seconds: "up to 0.7 s", "0.7 to 1.5 s", "more than 1.5 s"."""
    if not math.isfinite(low):
        return f"up to {number(high)} s"
    return f"{number(low)} to {number(high)} s" if math.isfinite(high) else f"more than {number(low)} s"


def rate(unit: str) -> str:
    """The unit of a change per second: "deg" -> "deg/s", "deg/s" -> "deg/s²", "" -> "1/s"."""
    return f"{unit}²" if unit.endswith("/s") else f"{unit or 1}/s"
