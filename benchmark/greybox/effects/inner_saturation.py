"""A saturation behind a lag."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.actuator_lag import lagged, lagged_step
from simgap.greybox.effects.effect import Effect, InputEffect, Parameter, Start
from simgap.greybox.effects.filtered_saturation import FilteredSaturation
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("inner_saturation")
@final
class InnerSaturation(InputEffect):
    """T dw/dt = u - w, u' = min(max(w, low), high): a limit between two linear filters."""

    name: ClassVar[str] = "inner_saturation"
    title: ClassVar[str] = "a saturation behind a lag of the actuator"
    explanation: ClassVar[str] = (
        "The actuator first follows its command like a filter, and what comes out of it is limited, on one side or on "
        "both: an amplifier behind a filter, a diode, a valve that is closed behind a slow positioner."
    )
    reference: ClassVar[str] = (
        "Schoukens, Suykens, Ljung, Wiener-Hammerstein benchmark, 15th IFAC Symposium on System Identification, 2009, "
        "fig. 1 (two filters with a diode between them)"
    )
    place_in_chain: ClassVar[int] = 75
    helpers: ClassVar[tuple[Callable[..., float], ...]] = (lagged_step,)
    substeps: ClassVar[int] = 4
    contains: ClassVar[Mapping[str, tuple[int, ...]]] = {"actuator_lag": (0,), "input_saturation": (2,)}
    refined: ClassVar[type[Effect] | None] = FilteredSaturation
    shows_in: ClassVar[tuple[ViewName, ...]] = ("amplitude", "input", "frequency band")
    confounders: ClassVar[dict[str, str]] = FilteredSaturation.confounders

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the time constant, and the limits; each may lie out of reach."""
        low, high = scales.u_low, scales.u_high
        middle = 0.5 * (low + high)
        return (
            Parameter("time constant", "s", 0.0, 0.25 * scales.duration),
            Parameter("lower limit", scales.u_unit, 1.5 * low - 0.5 * high, middle),
            Parameter("upper limit", scales.u_unit, middle, 1.5 * high - 0.5 * low),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a lag of a few samples, with a limit at either end or both, and from a longer lag with both."""
        reach = scales.u_high - scales.u_low
        low, high = scales.u_low + 0.25 * reach, scales.u_high - 0.25 * reach
        ends = ((3.0, low, high), (3.0, scales.u_low, high), (3.0, low, scales.u_high), (10.0, low, high))
        return [Start((n * scales.dt, *limits)) for n, *limits in ends if n * scales.dt < 0.2 * scales.duration]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the input moves at all."""
        return scales.u_high > scales.u_low

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Return u behind a lag of p[0] seconds, clipped to p[1] .. p[2]."""
        return np.clip(lagged(u, float(p[0]), h, u[:, 0]), p[1], max(p[1], p[2]))

    @staticmethod
    def step(u, p, i, m, j, h, k):
        """Return the same, substep by substep."""
        return min(max(lagged_step(u, p[i], m, j, h, k, u), p[i + 1]), max(p[i + 1], p[i + 2]))

    @staticmethod
    def cells(p: np.ndarray, h: float) -> int:
        """Return how many numbers the step keeps."""
        return 1
