"""A sensor that loses the sign of what it measures."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import OutputEffect, Parameter, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("absolute_sensor")
@final
class AbsoluteSensor(OutputEffect):
    """reading = abs(y)."""

    name: ClassVar[str] = "absolute_sensor"
    title: ClassVar[str] = "a sensor that loses the sign"
    explanation: ClassVar[str] = (
        "The sensor shows how large the quantity is but not its sign, as a tachometer that counts pulses or a "
        "rectifier does."
    )
    reference: ClassVar[str] = "Wigren and Schoukens, Coupled electric drives, Uppsala University TR 2017-024"
    visible_in_readings: ClassVar[bool] = True
    moves_poles: ClassVar[bool] = True
    place_in_chain: ClassVar[int] = 105
    hides_sign: ClassVar[bool] = True
    shows_in: ClassVar[tuple[ViewName, ...]] = ("sign of velocity", "position", "value", "level")
    confounders: ClassVar[dict[str, str]] = {
        "sensor_saturation": "move slowly through zero: a saturated reading stays there, a rectified one turns back",
        "quantisation": (
            "move slowly: a coarse reading jumps from step to step everywhere, a rectified one turns back at zero"
        ),
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return no parameter: there is nothing to estimate."""
        return ()

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from the effect as it is: it has no size."""
        return [Start(())]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the input takes both signs, and readings come near zero and never below, apart from noise."""
        return (
            abs(scales.y_low) < 0.4 * scales.y_high
            and scales.u_low < -0.2 * scales.u_max
            and scales.u_high > 0.2 * scales.u_max
        )

    @staticmethod
    def term(y: np.ndarray, p: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Return |y|."""
        return np.abs(y)

    @staticmethod
    def step(y, p, i, m, j, h, k):
        """Return the same, sample by sample."""
        return abs(y)
