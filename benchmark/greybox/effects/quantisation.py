"""A reading that comes in steps."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import OutputEffect, Parameter, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("quantisation")
@final
class Quantisation(OutputEffect):
    """reading = q round(y / q)."""

    name: ClassVar[str] = "quantisation"
    title: ClassVar[str] = "quantisation"
    explanation: ClassVar[str] = "The reading comes in steps: few counts of an encoder, few bits of a converter."
    reference: ClassVar[str] = "Widrow and Kollar, Quantization Noise, 2008, ch. 4"
    place_in_chain: ClassVar[int] = 140
    shows_in: ClassVar[tuple[ViewName, ...]] = ("position", "velocity", "value", "level")
    in_steps: ClassVar[bool] = True

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the step, which is read off the data and not estimated."""
        return (Parameter("step", scales.y_unit, scales.quantisation_step, scales.quantisation_step, fixed=True),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from the grid of the readings, if they lie on one."""
        return [Start((scales.quantisation_step,))] if scales.quantisation_step > 0 else []

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the readings lie on a grid."""
        return scales.quantisation_step > 0

    @staticmethod
    def term(y: np.ndarray, p: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Round y to the nearest multiple of p[0]."""
        return p[0] * np.round(y / p[0])

    @staticmethod
    def step(y, p, i, m, j, h, k):
        """Return the same, sample by sample; what is no number or grows without bound stays as it is."""
        return p[i] * round(y / p[i]) if y - y == 0.0 else y
