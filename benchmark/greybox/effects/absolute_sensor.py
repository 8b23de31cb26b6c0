"""A sensor without a sign."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.greybox.effects.effect import OutputEffect, Parameter, Scene, Start
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
    obvious: ClassVar[bool] = True
    reshapes: ClassVar[bool] = True
    shows_in: ClassVar[tuple[str, ...]] = ("sign of velocity", "position")
    twins: ClassVar[dict[str, str]] = {
        "sensor_saturation": "move slowly through zero: a saturated reading stays there, a rectified one bounces",
    }

    def parameters(self, scene: Scene) -> tuple[Parameter, ...]:
        """None."""
        return ()

    def starts(self, scene: Scene) -> list[Start]:
        """The effect is there or it is not."""
        return [Start(())]

    def suits(self, scene: Scene) -> bool:
        """Where no reading is below zero but for noise, though the input takes both signs."""
        return (
            scene.y_low > -0.4 * scene.y_high and scene.u_low < -0.2 * scene.u_max and scene.u_high > 0.2 * scene.u_max
        )

    @staticmethod
    def term(y: np.ndarray, p: np.ndarray, t: np.ndarray) -> np.ndarray:
        """The absolute value."""
        return np.abs(y)
