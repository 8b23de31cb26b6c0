"""A first-order lag of the sensor."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from scipy.signal import lfilter

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import OutputEffect, Parameter, SignalScales, Start
from simgap.registry import EFFECTS


@EFFECTS.register("sensor_lag")
@final
class SensorLag(OutputEffect):
    """T dr/dt = y - r, r the reading."""

    name: ClassVar[str] = "sensor_lag"
    title: ClassVar[str] = "sensor lag"
    explanation: ClassVar[str] = (
        "The reading follows the quantity like a first-order filter: a thermometer in its sheath, a filtered signal."
    )
    reference: ClassVar[str] = "Isermann, Mechatronic Systems, 2005, ch. 8"
    place_in_chain: ClassVar[int] = 110
    memory: ClassVar[int] = 1
    linear: ClassVar[bool] = True
    adds_pole: ClassVar[bool] = True
    of_one_mass: ClassVar[bool] = True
    shows_in: ClassVar[tuple[ViewName, ...]] = ("time since reversal", "frequency band")

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the time constant, and the range in which the reading may begin."""
        reach = scales.y_high - scales.y_low
        return (
            Parameter("time constant", "s", 0.0, 0.25 * scales.duration),
            Parameter("range of the reading", scales.y_unit, reach, reach, fixed=True, told=False),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from one sample to a good part of the record."""
        usual = [n * scales.dt for n in (0.7, 2.0, 5.0, 12.0) if n * scales.dt < 0.2 * scales.duration]
        return [Start((time_constant, scales.y_high - scales.y_low)) for time_constant in usual]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the kind of output says of which order the plant is; elsewhere one pole more is just order."""
        return scales.kind in ("position", "velocity")

    @staticmethod
    def term(y: np.ndarray, p: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Delay y by a first-order lag of p[0] seconds, exact for straight lines between samples; it starts settled."""
        return SensorLag.term_from(y, p, t, np.zeros(len(y)))

    @staticmethod
    def term_from(y: np.ndarray, p: np.ndarray, t: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Return the same where the reading begins by `start` of its range beside y."""
        if len(t) < 2 or p[0] <= 1e-3 * (t[1] - t[0]):
            return y
        ratio = (t[1] - t[0]) / p[0]
        decay = np.exp(-ratio)
        now = 1 - (1 - decay) / ratio  # weight of the new sample; the old one has the rest
        begun = (1 - now) * y[:, :1] + p[1] * start[:, None]
        reading, _ = lfilter([now, 1 - decay - now], [1.0, -decay], y, axis=1, zi=begun)
        return reading

    @staticmethod
    def step(y, p, i, m, j, h, k):
        """Return the same, sample by sample."""
        if p[i] <= 1e-3 * h:
            m[j + 1] = y
        elif k == 0:
            m[j + 1] = y + p[i + 1] * m[j]
        else:
            ratio = h / p[i]
            decay = math.exp(-ratio)
            now = 1 - (1 - decay) / ratio
            m[j + 1] = now * y + (1 - decay - now) * m[j] + decay * m[j + 1]
        m[j] = y
        return m[j + 1]

    @staticmethod
    def cells(p: np.ndarray, h: float) -> int:
        """Return how many numbers the step keeps."""
        return 2
