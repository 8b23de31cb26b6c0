"""A sensor whose offset grows steadily."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import OutputEffect, Parameter, SignalScales, Start
from simgap.registry import EFFECTS


@EFFECTS.register("sensor_drift")
@final
class SensorDrift(OutputEffect):
    """reading = y + r t, with another slope r in every experiment."""

    name: ClassVar[str] = "sensor_drift"
    title: ClassVar[str] = "sensor drift"
    explanation: ClassVar[str] = (
        "The reading wanders off steadily while the machine does not: an integrated gyro, a warming amplifier, a "
        "creeping load cell."
    )
    reference: ClassVar[str] = "Titterton and Weston, Strapdown Inertial Navigation Technology, 2004, ch. 4"
    own: ClassVar[int] = 1
    shows_in: ClassVar[tuple[ViewName, ...]] = ("time since the start", "drift within experiment")
    per_experiment: ClassVar[bool] = True

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the slope of the drift."""
        return (
            Parameter(
                "slope",
                scales.y_unit + "/s" if scales.y_unit else "1/s",
                -10 * scales.y_rms / scales.duration,
                10 * scales.y_rms / scales.duration,
            ),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a slow drift; its amplitude, and so its sign, is then estimated."""
        return [Start((0.1 * scales.y_rms / scales.duration,), amplitude=0)]

    @staticmethod
    def shapes(t: np.ndarray, duration: float) -> np.ndarray:
        """Return t."""
        return t[None]

    @staticmethod
    def term(y: np.ndarray, p: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Return y + p[0] t."""
        return y + p[0] * t
