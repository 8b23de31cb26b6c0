"""A gain that falls in the course of a run."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import InputEffect, Parameter, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("gain_fade")
@final
class GainFade(InputEffect):
    """u' = max(1 - r t, 0) u, t since the machine began to run."""

    name: ClassVar[str] = "gain_fade"
    title: ClassVar[str] = "a gain that fades with time"
    explanation: ClassVar[str] = (
        "The same input achieves less and less in the course of a run: a battery that runs down, a winding "
        "that warms up, a filter that clogs, oil that changes with temperature."
    )
    reference: ClassVar[str] = "Isermann, Fault-Diagnosis Applications, 2011, ch. 3"
    place_in_chain: ClassVar[int] = 20
    of_time: ClassVar[bool] = True
    instead_of_order: ClassVar[bool] = True
    shows_in: ClassVar[tuple[ViewName, ...]] = ("drift within experiment", "time since the start")
    confounders: ClassVar[dict[str, str]] = {
        "sensor_drift": "record at rest without input: a drift is still there, a fading gain has nothing to act on",
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the share of the gain that is lost per second; it is negative where the gain grows."""
        return (Parameter("loss rate", "1/s", -2.0 / scales.duration, 1.0 / scales.duration),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a slow loss; its amplitude, and so its sign, is then estimated."""
        return [Start((0.1 / scales.duration,), amplitude=0)]

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Return u max(1 - p[0] t, 0), with t at the middle of each step."""
        return GainFade.term_since(u, p, h, np.zeros(len(u)))

    @staticmethod
    def term_since(u: np.ndarray, p: np.ndarray, h: float, since: np.ndarray) -> np.ndarray:
        """Return the same for records that begin later."""
        t = since[:, None] + h * (np.arange(u.shape[1]) + 0.5)  # [E, K]
        return u * np.maximum(1 - p[0] * t, 0.0)

    @staticmethod
    def step(u, p, i, m, j, h, k):
        """Return the same, substep by substep."""
        return u * max(1 - p[i] * h * (k + 0.5), 0.0)
