"""Saturation of the actuator."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.findings import ViewName
from simgap.greybox.effects.effect import InputEffect, Parameter, SignalScales, Start
from simgap.registry import EFFECTS


@EFFECTS.register("input_saturation")
@final
class InputSaturation(InputEffect):
    """u' = min(max(u, -L), L)."""

    name: ClassVar[str] = "input_saturation"
    title: ClassVar[str] = "saturation of the actuator"
    explanation: ClassVar[str] = (
        "Beyond a limit more input brings nothing: the supply voltage, a current limit or the end of a valve's travel."
    )
    reference: ClassVar[str] = "Hippe, Windup in Control, 2006, ch. 1"
    place_in_chain: ClassVar[int] = 50
    shows_in: ClassVar[tuple[ViewName, ...]] = ("input", "amplitude")
    confounders: ClassVar[dict[str, str]] = {
        "quadratic_drag": (
            "hold constant inputs up to the largest: with saturation the steady output stops growing at once, with "
            "drag it bends"
        ),
        "sensor_saturation": "change the load at the largest input: the reading of a saturated sensor does not move",
        "cubic_stiffness": (
            "hold constant inputs up to the largest: saturation ends the growth at one value of the input"
        ),
        "backlash": "keep the input well below its largest value: play is still there, saturation is not",
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """The limit, the same both ways."""
        return (Parameter("limit", scales.u_unit, 0.02 * scales.u_max, scales.u_max),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Limits that are met seldom, and often."""
        return [Start((share * scales.u_max,)) for share in (0.9, 0.75, 0.55, 0.35)]

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Clip at p[0] both ways."""
        return np.clip(u, -p[0], p[0])
