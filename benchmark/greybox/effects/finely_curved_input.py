"""A static characteristic of the actuator that bends in several places."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import InputEffect, Parameter, Start
from simgap.greybox.effects.fine_curve import (
    fine_gains_in_words,
    finely_curved,
    finely_curved_step,
    parameters_of_fine_curve,
    risen,
    starts_of_fine_curve,
)
from simgap.greybox.effects.scales import SignalScales


@final
class FinelyCurvedInput(InputEffect):
    """du'/du = g(u) / mean(g), g linear between seven places of the range: monotone, of mean gain 1.

    It has the name of `curved_input`, of which it is the form with more numbers.
    """

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
    helpers: ClassVar[tuple[Callable[..., float], ...]] = (risen, finely_curved_step)
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
        """Return the gain at each place over that in the middle, and the range."""
        return parameters_of_fine_curve(scales.u_unit, scales.u_low, scales.u_high)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a straight line."""
        return starts_of_fine_curve(scales.u_unit, scales.u_low, scales.u_high)

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the input has a range."""
        return scales.u_high > scales.u_low

    def describe(self, values: dict[str, float]) -> str:
        """Add how the gain changes over the range."""
        return f"{self.explanation} Its gain is {fine_gains_in_words(values)}."

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Return u on its characteristic."""
        return finely_curved(u, p)

    @staticmethod
    def step(u, p, i, m, j, h, k):
        """Return the same, substep by substep."""
        return finely_curved_step(u, p, i)
