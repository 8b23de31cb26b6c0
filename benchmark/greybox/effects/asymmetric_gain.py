"""A gain that differs with the sign of the input."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.findings import ViewName
from simgap.greybox.effects.effect import InputEffect, Parameter, SignalScales, Start
from simgap.registry import EFFECTS


@EFFECTS.register("asymmetric_gain")
@final
class AsymmetricGain(InputEffect):
    """u' = (1 + a) u for u > 0, (1 - a) u for u < 0."""

    name: ClassVar[str] = "asymmetric_gain"
    title: ClassVar[str] = "gain that differs with direction"
    explanation: ClassVar[str] = (
        "The machine answers more strongly one way than the other: unequal areas of a cylinder, unequal halves of "
        "a power "
        "stage, a single-acting brake."
    )
    reference: ClassVar[str] = "Jelali and Kroll, Hydraulic Servo-systems, 2003, sec. 4.2"
    place_in_chain: ClassVar[int] = 30
    shows_in: ClassVar[tuple[ViewName, ...]] = ("input", "sign of velocity")
    confounders: ClassVar[dict[str, str]] = {
        "constant_load": (
            "let it run without input: a load still moves it; and compare steps up and down of several sizes: an "
            "unequal gain errs in proportion to the step, a load by the same amount"
        ),
        "quadratic_stiffness": (
            "hold constant inputs of several sizes both ways: an unequal gain gives two straight lines"
        ),
        "sensor_bias": "record at rest without input: a bias is still there",
        "dead_zone": "hold small constant inputs of both signs: inside a dead zone nothing moves either way",
        "input_saturation": (
            "hold constant inputs up to the largest: saturation ends the growth at one value of the input, an unequal "
            "gain does not"
        ),
        "backlash": "move in one direction without reversing: an unequal gain still errs, play does not",
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Half the difference of the two gains over their mean."""
        return (Parameter("asymmetry", "", -0.95, 0.95),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Either side stronger."""
        return [Start((0.1,), amplitude=0)]

    def applies_to(self, scales: SignalScales) -> bool:
        """Only where the input takes both signs."""
        return scales.u_low < 0 < scales.u_high

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Positive values grow by the share p[0], negative ones shrink by it."""
        return u + p[0] * np.abs(u)
