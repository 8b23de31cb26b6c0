"""A static characteristic of the sensor that bends in several places."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import OutputEffect, Parameter, Start
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
class FinelyCurvedSensor(OutputEffect):
    """d(reading)/dy = g(y) / mean(g), g linear between seven places of the range: monotone, of mean gain 1.

    It has the name of `curved_sensor`, of which it is the form with more numbers.
    """

    name: ClassVar[str] = "curved_sensor"
    title: ClassVar[str] = "a curved characteristic of the sensor"
    explanation: ClassVar[str] = (
        "The reading follows a curve over the measured quantity instead of a straight line: a thermistor, a pitot tube "
        "read as a pressure, an optical distance sensor, a linkage before a potentiometer."
    )
    reference: ClassVar[str] = (
        "Wigren, Recursive prediction error identification using the nonlinear Wiener model, Automatica 29, 1993, eq. 2"
    )
    place_in_chain: ClassVar[int] = 115
    helpers: ClassVar[tuple[Callable[..., float], ...]] = (risen, finely_curved_step)
    shows_in: ClassVar[tuple[ViewName, ...]] = ("position", "velocity", "value", "level", "amplitude")
    confounders: ClassVar[dict[str, str]] = {
        "sensor_saturation": (
            "move slowly beyond the largest reading: a saturated reading stands still, that of a curved sensor grows "
            "less and less"
        ),
        "cubic_stiffness": (
            "displace it far and a little and let it go: a spring changes how fast it swings, a curved sensor does not"
        ),
        "quadratic_stiffness": (
            "displace it far and a little and let it go: a spring changes how fast it swings, a curved sensor does not"
        ),
        "quadratic_drag": (
            "let it coast from several speeds: with drag the time until the reading has halved depends on the speed "
            "itself, or compare the reading with a second sensor at several constant speeds"
        ),
        "sqrt_outflow": "compare the reading with a ruler at several levels: only that of a curved sensor is off",
        "overflow": "compare the reading with a ruler at several levels: that of a curved sensor is off at all of them",
        "quantisation": (
            "move slowly: a coarse reading jumps from step to step everywhere, that of a curved sensor follows smoothly"
        ),
        "absolute_sensor": "move slowly through zero: a rectified reading turns back there, a curved one goes on",
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the gain at each place over that in the middle, and the range."""
        return parameters_of_fine_curve(scales.y_unit, scales.y_low, scales.y_high)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a straight line."""
        return starts_of_fine_curve(scales.y_unit, scales.y_low, scales.y_high)

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the readings have a range."""
        return scales.y_high > scales.y_low

    def describe(self, values: dict[str, float]) -> str:
        """Add how the gain changes over the range."""
        return f"{self.explanation} Its gain is {fine_gains_in_words(values)}."

    @staticmethod
    def term(y: np.ndarray, p: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Return y on its characteristic."""
        return finely_curved(y, p)

    @staticmethod
    def step(y, p, i, m, j, h, k):
        """Return the same, sample by sample."""
        return finely_curved_step(y, p, i)
