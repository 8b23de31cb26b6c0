"""A curved static characteristic by its gain at several places of the range."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from simgap.greybox.effects.curve import parameters_of_curve
from simgap.greybox.effects.effect import Parameter, Start

PLACES = ("the low end", "1/6 of the range", "1/3 of the range", "the middle", "2/3 of the range", "5/6 of the range",
          "the high end")  # fmt: skip
MIDDLE = PLACES.index("the middle")
PIECES = len(PLACES) - 1
LEAST, MOST = 0.02, 50.0  # of the gain in the middle


def parameters_of_fine_curve(unit: str, low: float, high: float) -> tuple[Parameter, ...]:
    """Return the gain at each place over that in the middle, and the range."""
    gains = [Parameter(f"gain at {place} over that in the middle", "", LEAST, MOST) for place in PLACES]
    gains[MIDDLE] = Parameter("gain in the middle", "", 1.0, 1.0, fixed=True)
    return (*gains, *parameters_of_curve(unit, low, high)[2:])


def starts_of_fine_curve(unit: str, low: float, high: float) -> list[Start]:
    """Start from a straight line; a better start knows the curve that was found with fewer numbers."""
    *_, middle, half = parameters_of_curve(unit, low, high)
    return [Start((*[1.0] * len(PLACES), middle.low, half.low))]


def refined_curve(curve: Float[np.ndarray, " 4"]) -> Float[np.ndarray, " 9"]:
    """Return the numbers of a curve with few, as those of a fine one."""
    ends, tilt, middle, half = curve
    z = np.linspace(-1.0, 1.0, len(PLACES))
    gains = 1 + ends * (2 * np.abs(z) - 1) + tilt * (1 + ends) * z
    return np.array([*np.clip(gains / max(gains[MIDDLE], LEAST), LEAST, MOST), middle, half])


def finely_curved(x: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Return the characteristic at x; it goes on straight beyond its range, and zero stays zero if it is inside.

    Its gain is linear between two places, and so changes from the one to the other over a piece of the range.
    """
    gains, low, piece = p[: len(PLACES)], p[-2] - p[-1], p[-1] / 3.0
    # Operation by operation what the step below does, so that an export differs by nothing.
    rest = min(max(0.0, low), low + 6.0 * piece)
    mean = _risen(6.0, gains) / 6.0
    return rest + piece / mean * (_risen((x - low) / piece, gains) - _risen((rest - low) / piece, gains))


def _risen(s: float | np.ndarray, gains: np.ndarray) -> float | np.ndarray:
    rise = gains[0] * s
    for k in range(PIECES):
        inside = np.clip(s - k, 0.0, 1.0)
        rise = rise + (gains[k + 1] - gains[k]) * (0.5 * inside * inside + np.maximum(s - k - 1.0, 0.0))
    return rise


def risen(s, p, i):
    """Return how far the characteristic rises from the low end to s, in pieces of the range."""
    rise = p[i] * s
    for k in range(6):
        inside = min(max(s - k, 0.0), 1.0)
        rise = rise + (p[i + k + 1] - p[i + k]) * (0.5 * inside * inside + max(s - k - 1.0, 0.0))
    return rise


def finely_curved_step(x, p, i):
    """Return the same as `finely_curved`, for one number."""
    low = p[i + 7] - p[i + 8]
    piece = p[i + 8] / 3.0
    rest = min(max(0.0, low), low + 6.0 * piece)
    mean = risen(6.0, p, i) / 6.0
    return rest + piece / mean * (risen((x - low) / piece, p, i) - risen((rest - low) / piece, p, i))


def fine_gains_in_words(values: dict[str, float]) -> str:
    """Say what the gain is at each place, over its mean."""
    gains = np.array(list(values.values())[: len(PLACES)])
    gains = gains / np.mean(0.5 * (gains[1:] + gains[:-1]))
    at = ", ".join(f"{gain:.2g} at {place}" for gain, place in zip(gains, PLACES, strict=True))
    return f"{at}, over its mean"
