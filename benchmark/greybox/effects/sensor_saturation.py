"""A sensor with a limited range."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import OutputEffect, Parameter, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS

AT_REST = 0.05  # share of the span of the readings that counts as standing still


@EFFECTS.register("sensor_saturation")
@final
class SensorSaturation(OutputEffect):
    """reading = min(max(y, low), high)."""

    name: ClassVar[str] = "sensor_saturation"
    title: ClassVar[str] = "saturation of the sensor"
    explanation: ClassVar[str] = "Beyond its range the sensor shows the end of its range, while the machine moves on."
    reference: ClassVar[str] = "Tao and Kokotovic, 1996, ch. 2"
    place_in_chain: ClassVar[int] = 130
    shows_in: ClassVar[tuple[ViewName, ...]] = ("position", "velocity", "value", "level", "amplitude")
    confounders: ClassVar[dict[str, str]] = {
        "sqrt_outflow": "empty it through a measured drain: a saturated reading stands still while the level falls",
        "quantisation": (
            "move slowly: a coarse reading jumps from step to step everywhere, a saturated one stands still beyond its "
            "limit"
        ),
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the lowest and the highest reading."""
        low, high, middle = scales.y_low, scales.y_high, 0.5 * (scales.y_low + scales.y_high)
        span = high - low
        low_at_rest, high_at_rest = self._at_rest(scales)
        return (
            Parameter(
                "lowest reading", scales.y_unit, low - 0.5 * span, low - AT_REST * span if low_at_rest else middle
            ),
            Parameter(
                "highest reading", scales.y_unit, high + AT_REST * span if high_at_rest else middle, high + 0.5 * span
            ),
        )

    @staticmethod
    def _at_rest(scales: SignalScales) -> tuple[bool, bool]:
        """Tell whether the lowest and the highest reading are those of a machine at rest: then they are no rails."""
        near = AT_REST * (scales.y_high - scales.y_low) if scales.kind == "velocity" else -1.0
        return abs(scales.y_low) < near, abs(scales.y_high) < near

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start just inside the extreme readings, at either end or both; not where the machine stands still."""
        span = scales.y_high - scales.y_low
        low_at_rest, high_at_rest = self._at_rest(scales)
        inside_low, inside_high = scales.y_low + 0.03 * span, scales.y_high - 0.03 * span
        beyond_low, beyond_high = scales.y_low - 0.4 * span, scales.y_high + 0.4 * span
        pairs = ((inside_low, inside_high), (inside_low, beyond_high), (beyond_low, inside_high))
        if low_at_rest or high_at_rest:
            pairs = ((beyond_low, inside_high),) if low_at_rest else ((inside_low, beyond_high),)
        return [Start(pair) for pair in pairs]

    @staticmethod
    def term(y: np.ndarray, p: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Return y clipped to p[0] .. p[1]."""
        return np.clip(y, p[0], max(p[0], p[1]))

    @staticmethod
    def step(y, p, i, m, j, h, k):
        """Return the same, sample by sample."""
        return min(max(y, p[i]), max(p[i], p[i + 1]))
