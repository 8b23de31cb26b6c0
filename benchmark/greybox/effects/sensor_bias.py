"""A sensor with an offset."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import Effect, OutputEffect, Parameter, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


class _Bias(OutputEffect):
    """reading = y + b."""

    name: ClassVar[str] = "sensor_bias"
    title: ClassVar[str] = "sensor bias"
    explanation: ClassVar[str] = (
        "The reading is off by a constant: a zero that was not set, or an encoder that counts from wherever it was "
        "switched on, in another experiment from elsewhere."
    )
    reference: ClassVar[str] = "Titterton and Weston, Strapdown Inertial Navigation Technology, 2004, ch. 4"
    of_one_mass: ClassVar[bool] = True
    shows_in: ClassVar[tuple[ViewName, ...]] = ("experiment", "offset")
    confounders: ClassVar[dict[str, str]] = {
        "sensor_drift": "record for longer: a drift goes on growing, a bias does not",
        "gravity": "hold the machine at two angles and read them with a level too: a bias is the same at both",
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the bias."""
        return (Parameter("bias", scales.y_unit, -10 * scales.y_rms, 10 * scales.y_rms),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a small bias; its amplitude, and so its sign, is then estimated."""
        return [Start((0.1 * scales.y_rms,), amplitude=0)]

    @staticmethod
    def term(y: np.ndarray, p: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Return y + p[0]."""
        return y + p[0]


@final
class SteadySensorBias(_Bias):
    """reading = y + b, with the same b in all experiments."""

    linear: ClassVar[bool] = True
    # The mean input that holds it at the true position drives a plant away that is modelled without a bias.
    may_move_poles_of: ClassVar[tuple[str, ...]] = ("position",)

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the plain model lacks an operating point that is fitted."""
        return scales.at_zero

    @staticmethod
    def step(y, p, i, m, j, h, k):
        """Return the same, sample by sample."""
        return y + p[i]


@EFFECTS.register("sensor_bias")
@final
class SensorBias(_Bias):
    """reading = y + b, with another b in every experiment."""

    own: ClassVar[int] = 1
    per_experiment: ClassVar[bool] = True
    steady: ClassVar[type[Effect] | None] = SteadySensorBias

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the reading has a zero of its own; that of any other quantity is its operating point."""
        return scales.kind != "other"

    @staticmethod
    def shapes(t: np.ndarray, duration: float, common: np.ndarray) -> np.ndarray:
        """Return 1."""
        return np.ones((1, len(t)))
