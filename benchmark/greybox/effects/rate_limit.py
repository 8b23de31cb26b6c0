"""An actuator of limited speed."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import InputEffect, Parameter, Start
from simgap.greybox.effects.kernels import limited_rate
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("rate_limit")
@final
class RateLimit(InputEffect):
    """-r_down <= du'/dt <= r_up; u' = u as soon as it has caught up."""

    name: ClassVar[str] = "rate_limit"
    title: ClassVar[str] = "an actuator of limited speed"
    explanation: ClassVar[str] = (
        "The actuator follows small and slow changes of its command and falls behind large and fast ones: a motor "
        "valve, a rudder or control surface, a ramp in the drive's settings; up and down need not be equally fast."
    )
    reference: ClassVar[str] = (
        "Klyde, McRuer, Myers, Pilot-induced oscillation analysis and prediction with actuator rate limiting, J. "
        "Guidance, Control and Dynamics 20, 1997, fig. 2 (fully developed rate limiting)"
    )
    on_goal: ClassVar[bool] = True
    place_in_chain: ClassVar[int] = 55
    substeps: ClassVar[int] = 4
    shows_in: ClassVar[tuple[ViewName, ...]] = ("time since reversal", "frequency band", "input")
    confounders: ClassVar[dict[str, str]] = {
        "actuator_lag": (
            "apply a small and a large step: with a lag both take the same time, with a limited speed the large one "
            "takes longer"
        ),
        "sensor_lag": (
            "apply a small and a large step: with a lag both take the same time, with a limited speed the large one "
            "takes longer"
        ),
        "input_delay": (
            "apply a small and a large step: a delay is the same for both, with a limited speed the large one takes "
            "longer"
        ),
        "backlash": (
            "repeat a slow triangle at half the speed: an actuator of limited speed then follows exactly, backlash "
            "stays as it was"
        ),
        "valve_stiction": (
            "repeat a slow triangle at half the speed: an actuator of limited speed then follows exactly, a valve "
            "still sticks"
        ),
        "hysteresis": (
            "repeat a slow triangle at half the speed: an actuator of limited speed then follows exactly, hysteresis "
            "stays as it was"
        ),
        "periodic_disturbance": (
            "record without any input: a disturbance goes on, a limited speed has nothing to act on"
        ),
        "input_saturation": (
            "hold the largest input for long: an actuator of limited speed gets there in the end, a saturated one "
            "does not"
        ),
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the largest speeds up and down; at the highest, the whole range takes a quarter of a sample."""
        reach, unit = scales.u_high - scales.u_low, f"{scales.u_unit or '1'}/s"
        low, high = 0.5 * reach / scales.duration, 4 * reach / scales.dt
        return Parameter("largest speed up", unit, low, high), Parameter("largest speed down", unit, low, high)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from speeds that cross the input's range in a few samples to a good part of the record."""
        reach = scales.u_high - scales.u_low
        crossings = [n * scales.dt for n in (3.0, 10.0, 30.0) if n * scales.dt < 0.5 * scales.duration]
        return [Start((reach / crossing,) * 2) for crossing in crossings]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the input moves at all."""
        return scales.u_high > scales.u_low

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Return the mean over each step of h seconds of u at limited speeds; it begins at the first value of u."""
        return limited_rate(u, p[0] * h, p[1] * h)

    @staticmethod
    def step(u, p, i, m, j, h, k):
        """Return the same, substep by substep."""
        if k == 0:
            m[j] = u
        way = u - m[j]
        speed = p[i] * h if way > 0.0 else p[i + 1] * h
        if abs(way) > speed:
            m[j] += math.copysign(speed, way)
            return m[j] - 0.5 * math.copysign(speed, way)
        m[j] = u
        return u - (0.5 * way * abs(way) / speed if speed > 0.0 else 0.0)

    @staticmethod
    def cells(p: np.ndarray, h: float) -> int:
        """Return how many numbers the step keeps."""
        return 1
