"""A sensor without a sign."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.findings import ViewName
from simgap.greybox.effects.effect import OutputEffect, Parameter, SignalScales, Start
from simgap.registry import EFFECTS


@EFFECTS.register("absolute_sensor")
@final
class AbsoluteSensor(OutputEffect):
    """reading = abs(y)."""

    name: ClassVar[str] = "absolute_sensor"
    title: ClassVar[str] = "sensor without a sign"
    explanation: ClassVar[str] = (
        "The sensor shows the size but not the direction: a tachometer that counts pulses, a rectifier."
    )
    reference: ClassVar[str] = "Wigren and Schoukens, Coupled electric drives, Uppsala University TR 2017-024"
    visible_in_readings: ClassVar[bool] = True
    moves_poles: ClassVar[bool] = True
    place_in_chain: ClassVar[int] = 120
    hides_sign: ClassVar[bool] = True
    shows_in: ClassVar[tuple[ViewName, ...]] = ("sign of velocity", "position", "value", "level")
    confounders: ClassVar[dict[str, str]] = {
        "sensor_saturation": "move slowly through zero: a saturated reading stays there, a rectified one bounces",
        "quantisation": (
            "move slowly: a coarse reading jumps from step to step everywhere, a rectified one turns back at zero"
        ),
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """None."""
        return ()

    def starts(self, scales: SignalScales) -> list[Start]:
        """The effect is there or it is not."""
        return [Start(())]

    def applies_to(self, scales: SignalScales) -> bool:
        """Where no reading is below zero but for noise, though the input takes both signs."""
        return (
            scales.y_low > -0.4 * scales.y_high
            and scales.u_low < -0.2 * scales.u_max
            and scales.u_high > 0.2 * scales.u_max
        )

    @staticmethod
    def term(y: np.ndarray, p: np.ndarray, t: np.ndarray) -> np.ndarray:
        """The absolute value."""
        return np.abs(y)
