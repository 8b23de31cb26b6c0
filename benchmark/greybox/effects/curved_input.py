"""A curved static characteristic of the actuator."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import InputEffect, Parameter, SignalScales, Start
from simgap.registry import EFFECTS

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

    def curve(z: float | np.ndarray) -> float | np.ndarray:
        inside = np.clip(z, -1.0, 1.0)
        size = np.abs(inside)
        slope = 1 + ends * (2 * size - 1) + tilt * inside
        return inside * (1 + ends * (size - 1)) + 0.5 * tilt * inside * inside + slope * (z - inside)

    rest = min(max(0.0, middle - half), middle + half)
    return rest + half * (curve((x - middle) / half) - curve((rest - middle) / half))


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


@EFFECTS.register("curved_input")
@final
class CurvedInput(InputEffect):
    """du'/du = 1 + a (2 abs(z) - 1) + b (1 + a) z, z = (u - middle) / (half of the range): monotone, of mean gain 1."""

    name: ClassVar[str] = "curved_input"
    title: ClassVar[str] = "a curved characteristic of the actuator"
    explanation: ClassVar[str] = (
        "What the actuator puts out follows a curve over its command instead of a straight line: thrust that grows "
        "with the square of the speed, a valve of equal percentage, a power stage."
    )
    reference: ClassVar[str] = (
        "Narendra and Gallman, An iterative method for the identification of nonlinear systems using a Hammerstein "
        "model, IEEE Trans. Automatic Control 11, 1966, eq. 1"
    )
    place_in_chain: ClassVar[int] = 45
    helpers: ClassVar[tuple[Callable[..., float], ...]] = (bent, curved_step)
    shows_in: ClassVar[tuple[ViewName, ...]] = ("input", "amplitude")
    confounders: ClassVar[dict[str, str]] = {
        "dead_zone": (
            "raise a constant input in small steps from zero: behind a dead zone nothing happens up to its edge, a "
            "curved characteristic answers weakly from the start"
        ),
        "input_saturation": (
            "raise a constant input in small steps to the largest: with saturation the output stops growing at one "
            "input, with a curved characteristic it grows less and less"
        ),
        "asymmetric_gain": (
            "hold constant inputs of several sizes in both directions: with an unequal gain the steady output lies on "
            "two straight lines, with a curved characteristic on a curve"
        ),
        "curved_sensor": (
            "apply a step from one operating point to another and back: behind a curved sensor the way up and the way "
            "down have different shapes, behind a curved actuator the same"
        ),
        "backlash": (
            "raise a constant input in small steps and lower it again: with backlash the way down differs from the way "
            "up, on a curved characteristic both are the same"
        ),
        "quadratic_drag": (
            "let it run fast, then set the input to zero: drag brakes it more than in proportion to its speed, behind "
            "a curved actuator it coasts as the linear model does"
        ),
        "cubic_stiffness": "displace it and let it go without input: only a spring changes how it swings",
        "quadratic_stiffness": "displace it and let it go without input: only a spring changes how it swings",
        "sqrt_outflow": "let it empty without inflow: only the outflow changes how the level falls",
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return how the gain rises to both ends and from end to end, each over its mean, and the range."""
        return parameters_of_curve(scales.u_unit, scales.u_low, scales.u_high)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from either bend alone."""
        return starts_of_curve(scales.u_unit, scales.u_low, scales.u_high)

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the input has a range."""
        return scales.u_high > scales.u_low

    def describe(self, values: dict[str, float]) -> str:
        """Add how the gain changes over the range."""
        return f"{self.explanation} Its gain is {gains_in_words(values)}."

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Return u on its characteristic."""
        return curved(u, p)

    @staticmethod
    def step(u, p, i, m, j, h, k):
        """Return the same, substep by substep."""
        return curved_step(u, p, i)
