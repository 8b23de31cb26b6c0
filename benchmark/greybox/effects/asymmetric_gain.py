"""A gain that differs with the sign of the input."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import InputEffect, Parameter, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("asymmetric_gain")
@final
class AsymmetricGain(InputEffect):
    """u' = (1 + a) u for u > 0, (1 - a) u for u < 0."""

    name: ClassVar[str] = "asymmetric_gain"
    title: ClassVar[str] = "a gain that differs with direction"
    explanation: ClassVar[str] = (
        "The machine answers more strongly in one direction than in the other: unequal areas of a cylinder, unequal "
        "halves of a power stage, a single-acting brake."
    )
    reference: ClassVar[str] = "Jelali and Kroll, Hydraulic Servo-systems, 2003, sec. 4.2"
    place_in_chain: ClassVar[int] = 30
    late_place: ClassVar[int | None] = 58  # early: halves of a power stage; late: areas of a cylinder
    shows_in: ClassVar[tuple[ViewName, ...]] = ("input", "sign of velocity")
    confounders: ClassVar[dict[str, str]] = {
        "constant_load": (
            "leave the input at zero: a load still moves the machine. Then apply steps of several sizes in both "
            "directions: the error of an unequal gain grows with the step, that of a load does not"
        ),
        "quadratic_stiffness": (
            "hold constant inputs of several sizes in both directions: with an unequal gain the steady output lies on "
            "two straight lines, with a quadratic spring on a curve"
        ),
        "sensor_bias": "record at rest without input: a bias is still there",
        "dead_zone": "apply small constant inputs of both signs: inside a dead zone neither moves the machine",
        "input_saturation": (
            "hold constant inputs up to the largest: with saturation the output stops growing at one input, with an "
            "unequal gain it goes on"
        ),
        "backlash": "move in one direction without reversing: an unequal gain still shows, backlash does not",
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return half the difference of the two gains over their mean."""
        return (Parameter("asymmetry", "", -0.95, 0.95),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a small asymmetry; its amplitude, and so its sign, is then estimated."""
        return [Start((0.1,), amplitude=0)]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the input takes both signs."""
        return scales.u_low < 0 < scales.u_high

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Return u + p[0] |u|: positive values grow by the share p[0], negative ones shrink by it."""
        return u + p[0] * np.abs(u)

    @staticmethod
    def step(u, p, i, m, j, h, k):
        """Return the same, substep by substep."""
        return u + p[i] * abs(u)
