"""Numbers as people read them: no more digits than they deserve."""

from __future__ import annotations

import math
import re


def number(value: float, digits: int = 3) -> str:
    """Round to significant digits, but never before the decimal point, and leave out zeros at the end.

    0.012345 -> "0.0123", 2.50 -> "2.5", 1234.5 -> "1234", 0.0000123 -> "1.23e-5".
    """
    if not math.isfinite(value) or value == 0:
        return f"{abs(value) if value == 0 else value:g}"
    before = math.floor(math.log10(abs(value))) + 1
    rounded = float(f"{value:.{max(digits, min(before, 6))}g}")  # first, or 99.7 of two digits would be 1e+02
    return short_exponent(f"{rounded:.{max(digits, 6)}g}")


def amount(value: float, unit: str, digits: int = 3) -> str:
    """Write a number with its unit: 2.5, "deg" -> "2.5 deg"."""
    return f"{number(value, digits)} {unit}".rstrip() if math.isfinite(value) else "diverges"


def percent(share: float) -> str:
    """Write a share in percent so that what lacks to 100 % shows: 0.613 -> "61 %", 0.9968 -> "99.7 %"."""
    percents = 100 * share
    if not math.isfinite(percents):
        return "an unknown share"
    if 0 < abs(percents) < 1:
        return "less than 1 %"
    places = -math.floor(math.log10(100 - percents)) if 99 < percents < 100 else 0
    return f"{percents:.{places if 0 < places <= 6 else 0}f} %"


def short_exponent(text: str) -> str:
    """Write the exponent of a formatted float as people do: "1.2e-05" -> "1.2e-5", "1e+06" -> "1e6"."""
    return re.sub(r"e\+?(-?)0*", r"e\1", text)
