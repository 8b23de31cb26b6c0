"""A curved static characteristic of the sensor."""

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
from simgap.greybox.effects.effect import Effect, OutputEffect, Parameter, Start
from simgap.greybox.effects.fine_curve import refined_curve
from simgap.greybox.effects.finely_curved_sensor import FinelyCurvedSensor
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("curved_sensor")
@final
class CurvedSensor(OutputEffect):
    """d(reading)/dy = 1 + a (2 abs(z) - 1) + b (1 + a) z, z = (y - middle) / (half of the range): monotone."""

    name: ClassVar[str] = FinelyCurvedSensor.name
    title: ClassVar[str] = FinelyCurvedSensor.title
    explanation: ClassVar[str] = FinelyCurvedSensor.explanation
    reference: ClassVar[str] = FinelyCurvedSensor.reference
    place_in_chain: ClassVar[int] = FinelyCurvedSensor.place_in_chain
    helpers: ClassVar[tuple[Callable[..., float], ...]] = (bent, curved_step)
    refined: ClassVar[type[Effect] | None] = FinelyCurvedSensor
    shows_in: ClassVar[tuple[ViewName, ...]] = FinelyCurvedSensor.shows_in
    confounders: ClassVar[dict[str, str]] = FinelyCurvedSensor.confounders

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return how the gain rises to both ends and from end to end, each over its mean, and the range."""
        return parameters_of_curve(scales.y_unit, scales.y_low, scales.y_high)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from either bend alone."""
        return starts_of_curve(scales.y_unit, scales.y_low, scales.y_high)

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the readings have a range."""
        return scales.y_high > scales.y_low

    def as_refined(self, values: Float[np.ndarray, " 4"]) -> Float[np.ndarray, " 9"]:
        """Return the numbers of the same curve by its gains at several places."""
        return refined_curve(values)

    def describe(self, values: dict[str, float]) -> str:
        """Add how the gain changes over the range."""
        return f"{self.explanation} Its gain is {gains_in_words(values)}."

    @staticmethod
    def term(y: np.ndarray, p: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Return y on its characteristic."""
        return curved(y, p)

    @staticmethod
    def step(y, p, i, m, j, h, k):
        """Return the same, sample by sample."""
        return curved_step(y, p, i)
