"""Dead zone of the actuator."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.findings import ViewName
from simgap.greybox.effects.effect import InputEffect, Parameter, SignalScales, Start
from simgap.registry import EFFECTS


@EFFECTS.register("dead_zone")
@final
class DeadZone(InputEffect):
    """u' = u - w sign(u) where abs(u) > w, else 0."""

    name: ClassVar[str] = "dead_zone"
    title: ClassVar[str] = "dead zone of the actuator"
    explanation: ClassVar[str] = (
        "Small inputs have no effect, and larger ones arrive reduced by the same amount: overlap of a valve's spool, "
        "the threshold of a power stage or of a brush."
    )
    reference: ClassVar[str] = (
        "Tao and Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996, ch. 2"
    )
    place_in_chain: ClassVar[int] = 40
    shows_in: ClassVar[tuple[ViewName, ...]] = ("input", "amplitude")
    confounders: ClassVar[dict[str, str]] = {
        "coulomb_friction": (
            "drive it at constant speed with slowly rising input in one direction only: friction keeps its force "
            "while it moves, a dead zone acts on the input alone; then brake without input and watch the stop"
        ),
        "backlash": "reverse the input slowly with large and small strokes: play shows only after a reversal",
        "quadratic_drag": (
            "hold several constant inputs: the steady output over the input is a kinked line for a dead zone"
        ),
        "input_saturation": (
            "raise a constant input step by step: a dead zone takes the same amount from every input, saturation "
            "takes only from the largest"
        ),
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Half the width of the zone."""
        return (Parameter("half width", scales.u_unit, 0.0, 0.9 * scales.u_max),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """From a narrow zone to one that swallows half of the input."""
        return [Start((share * scales.u_max,)) for share in (0.05, 0.15, 0.3, 0.5)]

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Shrink towards zero by p[0]."""
        return np.sign(u) * np.maximum(np.abs(u) - p[0], 0.0)
