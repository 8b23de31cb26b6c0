"""A sensor whose offset grows steadily."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import Effect, OutputEffect, Parameter, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


def _slope(scales: SignalScales) -> Parameter:
    most = 10 * scales.y_rms / scales.duration
    return Parameter("slope", scales.y_unit + "/s" if scales.y_unit else "1/s", -most, most)


class _Drift(OutputEffect):
    """A reading that drifts, whatever its law."""

    name: ClassVar[str] = "sensor_drift"
    title: ClassVar[str] = "sensor drift"
    explanation: ClassVar[str] = (
        "The reading wanders off steadily while the machine does not: an integrated gyro, a warming amplifier, a "
        "creeping load cell."
    )
    reference: ClassVar[str] = "Titterton and Weston, Strapdown Inertial Navigation Technology, 2004, ch. 4"
    shows_in: ClassVar[tuple[ViewName, ...]] = ("time since the start", "drift within experiment")


@final
class SteadySensorDrift(_Drift):
    """reading = y + r t + b, t since the machine began to run; b is zero where the plant has an operating point."""

    of_time: ClassVar[bool] = True
    contains: ClassVar[Mapping[str, tuple[int, ...]]] = {"sensor_bias": (1,)}
    instead_of_order: ClassVar[bool] = True
    moves_poles: ClassVar[bool] = True

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the slope of the drift, and how far off the reading was when the machine began to run."""
        most, name = 10 * scales.y_rms, "offset at the start"
        offset = Parameter(name, scales.y_unit, -most, most) if scales.at_zero else Parameter.absent(name)
        return _slope(scales), offset

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a slow drift; its amplitude, and so its sign, is then estimated."""
        return [Start((_slope(scales).high / 100, 0.0), amplitude=0)]

    @staticmethod
    def term(y: np.ndarray, p: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Return y + p[0] t + p[1]."""
        return y + p[0] * t + p[1]

    @staticmethod
    def step(y, p, i, m, j, h, k):
        """Return the same, sample by sample."""
        return y + p[i] * h * k + p[i + 1]


@EFFECTS.register("sensor_drift")
@final
class SensorDrift(_Drift):
    """reading = y + r t, t since its start, with another slope r in every experiment."""

    own: ClassVar[int] = 1
    per_experiment: ClassVar[bool] = True
    steady: ClassVar[type[Effect] | None] = SteadySensorDrift

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the slope of the drift."""
        return (_slope(scales),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a slow drift; its slope in each experiment is then estimated."""
        return [Start((_slope(scales).high / 100,), amplitude=0)]

    @staticmethod
    def shapes(t: np.ndarray, duration: float, common: np.ndarray) -> np.ndarray:
        """Return t."""
        return t[None]

    @staticmethod
    def term(y: np.ndarray, p: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Return y + p[0] t."""
        return y + p[0] * t
