"""A curved static characteristic by two numbers: how its gain rises to both ends, and from end to end."""

from __future__ import annotations

import numpy as np

from simgap.greybox.effects.effect import Parameter, Start

TWO_SIDED = 0.2  # share of the largest value that either sign must reach for zero to be the middle


def parameters_of_curve(unit: str, low: float, high: float) -> tuple[Parameter, ...]:
    """Return slope, bend, middle and half range of a characteristic over the values from low to high."""
    largest = max(abs(low), abs(high))
    two_sided = low < -TWO_SIDED * largest and high > TWO_SIDED * largest
    middle = 0.0 if two_sided else 0.5 * (low + high)
    half = max(high - middle, middle - low)
    return (
        Parameter("rise of the gain towards both ends", "", -1.0, 1.0),
        Parameter("rise of the gain from the low to the high end", "", -1.0, 1.0),
        Parameter("middle of the range", unit, middle, middle, fixed=True),
        Parameter("half of the range", unit, half, half, fixed=True),
    )


def starts_of_curve(unit: str, low: float, high: float) -> list[Start]:
    """Start from either bend alone; its amplitude, and so its sign, is then estimated."""
    *_, middle, half = parameters_of_curve(unit, low, high)
    return [Start((0.2, 0.0, middle.low, half.low), amplitude=0), Start((0.0, 0.2, middle.low, half.low), amplitude=1)]


def curved(x: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Return the characteristic at x; it goes on straight beyond its range, and zero stays zero if it is inside."""
    ends, tilt, middle, half = p
    tilt = tilt * (1 + ends)  # so that no gain is negative, and every one that is not has its two numbers
    rest = min(max(0.0, middle - half), middle + half)
    return rest + half * (_curve((x - middle) / half, ends, tilt) - _curve((rest - middle) / half, ends, tilt))


def _curve(z: float | np.ndarray, ends: float, tilt: float) -> float | np.ndarray:
    inside = np.clip(z, -1.0, 1.0)
    size = np.abs(inside)
    slope = 1 + ends * (2 * size - 1) + tilt * inside
    return inside * (1 + ends * (size - 1)) + 0.5 * tilt * inside * inside + slope * (z - inside)


def bent(z, ends, tilt):
    """Return the characteristic at z, the place in the range from -1 to 1."""
    inside = min(max(z, -1.0), 1.0)
    size = abs(inside)
    slope = 1 + ends * (2 * size - 1) + tilt * inside
    return inside * (1 + ends * (size - 1)) + 0.5 * tilt * inside * inside + slope * (z - inside)


def curved_step(x, p, i):
    """Return the same as `curved`, for one number."""
    ends = p[i]
    tilt = p[i + 1] * (1 + ends)
    rest = min(max(0.0, p[i + 2] - p[i + 3]), p[i + 2] + p[i + 3])
    change = bent((x - p[i + 2]) / p[i + 3], ends, tilt) - bent((rest - p[i + 2]) / p[i + 3], ends, tilt)
    return rest + p[i + 3] * change


def gains_in_words(values: dict[str, float]) -> str:
    """Compare the gains at the ends with that in the middle."""
    ends, tilt, *_ = values.values()
    tilt *= 1 + ends
    at = {"lowest": 1 + ends - tilt, "middle": 1 - ends, "highest": 1 + ends + tilt}
    return ", ".join(f"{gain:.2g} times the mean at the {where} value" for where, gain in at.items())
