"""A hysteretic force."""

from __future__ import annotations

import math
from typing import ClassVar, final

from simgap.findings import ViewName
from simgap.greybox.effects.effect import MOTION, ForceEffect, Parameter, Role, SignalScales, Start
from simgap.registry import EFFECTS


@EFFECTS.register("hysteresis")
@final
class Hysteresis(ForceEffect):
    """f = -F z, d dz/dt = v - (abs(v) z + v abs(z)) / 2 (Bouc-Wen, n = 1, beta = gamma)."""

    name: ClassVar[str] = "hysteresis"
    title: ClassVar[str] = "hysteresis"
    explanation: ClassVar[str] = (
        "A force that depends on the path and not on the speed: after each reversal it builds up over a certain travel "
        "and then stays. Seals, wire ropes, piezo stacks, friction before sliding."
    )
    reference: ClassVar[str] = "Bouc 1967, Wen 1976; Ismail, Ikhouane, Rodellar, Arch. Comput. Methods Eng. 16, 2009"
    role: ClassVar[Role] = "force"
    shows_in: ClassVar[tuple[ViewName, ...]] = ("time since reversal", "sign of velocity", "rate of change")
    confounders: ClassVar[dict[str, str]] = {
        "stribeck_friction": (
            "make very small strokes: a hysteretic force pulls back like a spring, dry friction just sticks"
        ),
        "sensor_lag": (
            "repeat a slow triangle at half the speed: with a lag the loop of output over input becomes half as wide, "
            "with hysteresis it stays as it was"
        ),
        "input_delay": (
            "repeat a slow triangle at half the speed: with a delay the loop of output over input becomes half as "
            "wide, with hysteresis it stays as it was"
        ),
        "quadratic_drag": (
            "run at two constant speeds, one twice the other: drag becomes four times as large, a hysteretic force "
            "stays the same"
        ),
    }
    memory: ClassVar[int] = 1

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the force after a long travel, and the travel in which it builds up."""
        return (
            Parameter("force", scales.force_unit, -10 * scales.force_rms, 10 * scales.force_rms),
            Parameter("travel", scales.unit(1, 0), 0.003 * scales.stroke, 2 * scales.stroke),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a short travel to a long one."""
        return [Start((0.1 * scales.force_rms, share * scales.stroke), amplitude=0) for share in (0.02, 0.07, 0.2, 0.6)]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the output is that of a motion."""
        return scales.kind in MOTION

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Return the mean force over the step, with z followed exactly for a constant velocity."""
        before, travel = m[j], v * h / p[i + 1]
        z = before
        if travel * z < 0:  # back towards zero: elastic
            elastic = math.copysign(min(abs(travel), abs(z)), travel)
            z += elastic
            travel -= elastic
        side = math.copysign(1.0, travel)
        m[j] = side + (z - side) * math.exp(-abs(travel))
        return -p[i] * 0.5 * (before + m[j])
