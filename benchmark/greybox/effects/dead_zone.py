"""A dead zone of the actuator."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import InputEffect, Parameter, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("dead_zone")
@final
class DeadZone(InputEffect):
    """u' = u - w sign(u) where abs(u) > w, else 0."""

    name: ClassVar[str] = "dead_zone"
    title: ClassVar[str] = "a dead zone of the actuator"
    explanation: ClassVar[str] = (
        "Small inputs have no effect, and larger ones arrive reduced by the same amount: the overlap of a valve spool, "
        "the threshold of a power stage, the voltage drop of brushes."
    )
    reference: ClassVar[str] = (
        "Tao and Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996, ch. 2"
    )
    place_in_chain: ClassVar[int] = 40
    shows_in: ClassVar[tuple[ViewName, ...]] = ("input", "amplitude")
    confounders: ClassVar[dict[str, str]] = {
        "quadratic_drag": (
            "hold several constant inputs: over the input, the steady speed has a kink with a dead zone and bends "
            "gradually with drag"
        ),
        "stribeck_friction": (
            "let it run, then set the input to zero: friction brakes it to a stop, behind a dead zone it coasts as the "
            "linear model does"
        ),
        "input_saturation": (
            "raise a constant input step by step: a dead zone takes the same amount from every input, saturation takes "
            "only from the largest"
        ),
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return half the width of the zone."""
        return (Parameter("half width", scales.u_unit, 0.0, 0.9 * scales.u_max),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a narrow zone to one that swallows half of the input."""
        return [Start((share * scales.u_max,)) for share in (0.05, 0.15, 0.3, 0.5)]

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Return u shrunk towards zero by p[0]."""
        return np.sign(u) * np.maximum(np.abs(u) - p[0], 0.0)

    @staticmethod
    def step(u, p, i, m, j, h, k):
        """Return the same, substep by substep."""
        return math.copysign(max(abs(u) - p[i], 0.0), u)
