"""A limit of the actuator."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import InputEffect, Parameter, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("input_saturation")
@final
class InputSaturation(InputEffect):
    """u' = min(max(u, -L), L)."""

    name: ClassVar[str] = "input_saturation"
    title: ClassVar[str] = "saturation of the actuator"
    explanation: ClassVar[str] = (
        "Beyond a limit more input has no effect: the supply voltage, a current limit, the end of a valve's travel."
    )
    reference: ClassVar[str] = "Hippe, Windup in Control, 2006, ch. 1"
    on_command: ClassVar[bool] = True
    place_in_chain: ClassVar[int] = 50
    shows_in: ClassVar[tuple[ViewName, ...]] = ("input", "amplitude")
    confounders: ClassVar[dict[str, str]] = {
        "quadratic_drag": (
            "hold constant inputs up to the largest: with saturation the steady speed stops growing at one input, with "
            "drag it grows more and more slowly"
        ),
        "sensor_saturation": (
            "change the load at the largest input: a saturated reading does not move, the reading behind a saturated "
            "actuator does"
        ),
        "overflow": (
            "fill it slowly with a small input: an overflow still stops the level, a saturated actuator does not"
        ),
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the limit, the same in both directions."""
        return (Parameter("limit", scales.u_unit, 0.02 * scales.u_max, scales.u_max),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from limits that are met seldom to one that is met often."""
        return [Start((share * scales.u_max,)) for share in (0.9, 0.75, 0.55, 0.35)]

    @staticmethod
    def command(c, error, t, h, p, i, m, j):
        """Return the command of a controller clipped to -p[i] .. p[i]."""
        return min(max(c, -p[i]), p[i])

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Return u clipped to -p[0] .. p[0]."""
        return np.clip(u, -p[0], p[0])

    @staticmethod
    def step(u, p, i, m, j, h, k):
        """Return the same, substep by substep."""
        return min(max(u, -p[i]), p[i])
