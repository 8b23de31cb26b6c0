"""A rounded saturation behind a filter of third order."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import ClassVar, final

import numpy as np
from jaxtyping import Float

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.actuator_lag import lagged, lagged_step
from simgap.greybox.effects.effect import InputEffect, Parameter, Start
from simgap.greybox.effects.kernels import second_order
from simgap.greybox.effects.scales import SignalScales

FAST = 1e-3  # steps: a filter with a shorter time constant is none
SHARP = 1e-6  # of the reach of the input: a rounding that is none


@final
class FilteredSaturation(InputEffect):
    """T dv/dt = u - v,  T2^2 w'' + 2 D T2 w' + w = v,  u' = w between two rounded limits, a share of it beyond them.

    u' = w - (1 - q) r (log(1 + exp((w - high) / r)) - log(1 + exp((low - w) / r)))

    It has the name of `inner_saturation`, of which it is the form with more numbers.
    """

    name: ClassVar[str] = "inner_saturation"
    title: ClassVar[str] = "a saturation between two filters"
    explanation: ClassVar[str] = (
        "The command first passes a filter, and what comes out of it is limited before it acts on the rest: an "
        "amplifier behind a filter, a diode between two circuits, a valve that is closed behind a slow positioner. "
        "The limit may be rounded, and let a share of the rest pass."
    )
    reference: ClassVar[str] = (
        "Schoukens, Suykens, Ljung, Wiener-Hammerstein benchmark, 15th IFAC Symposium on System Identification, 2009, "
        "fig. 1 (two filters of third order with a diode between them)"
    )
    place_in_chain: ClassVar[int] = 75
    substeps: ClassVar[int] = 4
    contains: ClassVar[Mapping[str, tuple[int, ...]]] = {
        "inner_saturation": (0, 1, 2), "actuator_lag": (0,), "input_saturation": (2,)
    }  # fmt: skip
    shows_in: ClassVar[tuple[ViewName, ...]] = ("amplitude", "input", "frequency band")
    confounders: ClassVar[dict[str, str]] = {
        "actuator_lag": "apply steps of several sizes: behind a lag alone all of them end in proportion to the input",
        "input_saturation": (
            "apply short pulses beyond the limit: a saturation behind a lag lets most of a short pulse pass, one "
            "before it cuts every pulse"
        ),
        "rate_limit": "hold the largest input for long: an actuator of limited speed gets there in the end",
        "sensor_saturation": (
            "change the load at the largest input: a saturated reading does not move, the reading behind a saturated "
            "actuator does"
        ),
    }
    helpers: ClassVar[tuple[Callable[..., float], ...]] = (lagged_step,)

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the numbers of the filter, the limits, which may lie out of reach, their rounding and what passes."""
        low, high, reach = scales.u_low, scales.u_high, scales.u_high - scales.u_low
        middle, longest = 0.5 * (low + high), 0.25 * scales.duration
        return (
            Parameter("time constant", "s", 0.0, longest),
            Parameter("lower limit", scales.u_unit, low - 0.5 * reach, middle),
            Parameter("upper limit", scales.u_unit, middle, high + 0.5 * reach),
            Parameter("second time constant", "s", 0.0, longest),
            Parameter("damping ratio", "", 0.02, 3.0),
            Parameter("rounding", scales.u_unit, 0.0, reach),
            Parameter("share beyond the limits", "", 0.0, 0.9),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a filter of a few samples and either limit; a better start knows the poles of the plain model."""
        reach = scales.u_high - scales.u_low
        low, high = scales.u_low + 0.25 * reach, scales.u_high - 0.25 * reach
        return [
            Start((scales.dt, *limits, 2.0 * scales.dt, 0.5, 0.05 * reach, 0.02))
            for limits in ((low, high), (scales.u_low, high), (low, scales.u_high))
        ]

    @staticmethod
    def begun(limit: np.ndarray, time_constant: float, damping: float, scales: SignalScales) -> Float[np.ndarray, " 7"]:
        """Return the numbers to begin with, from those of a limit behind a lag and from a section of second order."""
        rounding = 0.05 * (scales.u_high - scales.u_low)
        return np.array([max(limit[0], scales.dt), *limit[1:], time_constant, damping, rounding, 0.02])

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the input moves at all."""
        return scales.u_high > scales.u_low

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Return what arrives of u [E, K] behind the filter and the limits."""
        lag, low, high, second, damping, rounding, beyond = map(float, p)
        w = lagged(u, lag, h, u[:, 0])
        if second > FAST * h:
            w = second_order(np.ascontiguousarray(w), second, damping, h)
        high = max(low, high)
        if rounding <= SHARP * (high - low):
            return w + (1.0 - beyond) * (np.clip(w, low, high) - w)
        over, under = (np.logaddexp(0.0, side / rounding) for side in (w - high, low - w))
        return w - (1.0 - beyond) * rounding * (over - under)

    @staticmethod
    def step(u, p, i, m, j, h, k):
        """Return the same, substep by substep; it keeps the lag, and x and x' of the filter behind it."""
        w = lagged_step(u, p[i], m, j, h, k, u)
        t = p[i + 3]
        if k == 0:
            m[j + 1] = w
            m[j + 2] = 0.0
        if t > 1e-3 * h:  # FAST
            decay = p[i + 4] * h / t
            square = (p[i + 4] * p[i + 4] - 1.0) * h * h / (t * t)
            root = math.sqrt(abs(square))
            c = math.exp(-decay)
            s = c
            if square > 1e-12:
                c = 0.5 * (math.exp(root - decay) + math.exp(-decay - root))
                s = 0.5 * (math.exp(root - decay) - math.exp(-decay - root)) / root
            if square < -1e-12:
                s = c * math.sin(root) / root
                c = c * math.cos(root)
            away = m[j + 1] - w
            v = m[j + 2]
            m[j + 1] = w + (c + decay * s) * away + h * s * v
            m[j + 2] = (c - decay * s) * v - s * h * away / (t * t)
            w = w - t * (t * (m[j + 2] - v) + 2.0 * p[i + 4] * (m[j + 1] - w - away)) / h
        low = p[i + 1]
        high = max(low, p[i + 2])
        r = p[i + 5]
        if r <= 1e-6 * (high - low):  # SHARP
            return w + (1.0 - p[i + 6]) * (min(max(w, low), high) - w)
        over = max(w - high, 0.0) / r + math.log(1.0 + math.exp(-abs(w - high) / r))
        under = max(low - w, 0.0) / r + math.log(1.0 + math.exp(-abs(low - w) / r))
        return w - (1.0 - p[i + 6]) * r * (over - under)

    @staticmethod
    def cells(p: np.ndarray, h: float) -> int:
        """Return how many numbers the step keeps."""
        return 3
