"""Single readings that are far off."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import OutputEffect, Parameter, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("outliers")
@final
class Outliers(OutputEffect):
    """reading = y + a few single errors: e has the density (1 - r) N(0, s^2) + r N(0, S^2)."""

    name: ClassVar[str] = "outliers"
    title: ClassVar[str] = "outliers"
    explanation: ClassVar[str] = (
        "Single readings are far off and the next one is right again: a loose plug, a lost packet, a reflection."
    )
    reference: ClassVar[str] = "Huber and Ronchetti, Robust Statistics, 2009, ch. 1"
    place_in_chain: ClassVar[int] = 150
    simulated: ClassVar[bool] = False
    shows_in: ClassVar[tuple[ViewName, ...]] = ("size by experiment",)
    per_experiment: ClassVar[bool] = True

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the share of readings that are off, and how far; both are estimated from the errors."""
        return (
            Parameter("share of readings", "", 0.0, 0.2, fixed=True),
            Parameter("size", scales.y_unit, 0.0, 100 * scales.y_rms, fixed=True),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Return no start: outliers are found in the errors of a simulation without them."""
        return []

    @staticmethod
    def term(y: np.ndarray, p: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Return y: which reading is off cannot be simulated."""
        return y
