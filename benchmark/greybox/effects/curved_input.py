"""A curved static characteristic of the actuator."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, final

import numpy as np
from jaxtyping import Float

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.curve import (
    bent,
    curved,
    curved_step,
    gains_in_words,
    parameters_of_curve,
    starts_of_curve,
)
from simgap.greybox.effects.effect import Effect, InputEffect, Parameter, Start
from simgap.greybox.effects.fine_curve import refined_curve
from simgap.greybox.effects.finely_curved_input import FinelyCurvedInput
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("curved_input")
@final
class CurvedInput(InputEffect):
    """du'/du = 1 + a (2 abs(z) - 1) + b (1 + a) z, z = (u - middle) / (half of the range): monotone, of mean gain 1."""

    name: ClassVar[str] = FinelyCurvedInput.name
    title: ClassVar[str] = FinelyCurvedInput.title
    explanation: ClassVar[str] = FinelyCurvedInput.explanation
    reference: ClassVar[str] = FinelyCurvedInput.reference
    place_in_chain: ClassVar[int] = FinelyCurvedInput.place_in_chain
    helpers: ClassVar[tuple[Callable[..., float], ...]] = (bent, curved_step)
    refined: ClassVar[type[Effect] | None] = FinelyCurvedInput
    shows_in: ClassVar[tuple[ViewName, ...]] = FinelyCurvedInput.shows_in
    confounders: ClassVar[dict[str, str]] = FinelyCurvedInput.confounders

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return how the gain rises to both ends and from end to end, each over its mean, and the range."""
        return parameters_of_curve(scales.u_unit, scales.u_low, scales.u_high)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from either bend alone."""
        return starts_of_curve(scales.u_unit, scales.u_low, scales.u_high)

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the input has a range."""
        return scales.u_high > scales.u_low

    def as_refined(self, values: Float[np.ndarray, " 4"]) -> Float[np.ndarray, " 9"]:
        """Return the numbers of the same curve by its gains at several places."""
        return refined_curve(values)

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
