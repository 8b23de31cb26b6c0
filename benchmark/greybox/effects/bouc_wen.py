"""A hysteretic force whose stiffness under load and while it is relieved are numbers of their own."""

from __future__ import annotations

import math
from typing import ClassVar, final

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import MOTION, ForceEffect, Parameter, Role, Start
from simgap.greybox.effects.scales import SignalScales


@final
class BoucWen(ForceEffect):
    """f = -K w, dw/dt = v - (a + b) abs(v) w / 2 - (a - b) v abs(w) / 2 (Bouc-Wen, n = 1).

    So dw/dx is 1 - a w along a motion that loads it, and 1 + b abs(w) along one that relieves it. It has the name of
    `hysteresis`, of which it is the form with more numbers.
    """

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
    begins_anywhere: ClassVar[bool] = True

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the stiffness, by how much it falls under load and rises while it is relieved, and the gap."""
        shortest, stroke = 0.003 * scales.stroke, scales.stroke
        most, least = 10 * scales.force_rms / shortest, 0 if scales.order == 0 else -1
        per_travel = scales.unit(-1, 0)
        return (
            Parameter("stiffness", scales.force_over(x=1), least * most, most),
            Parameter("loss under load", per_travel, -2 / stroke, 1 / shortest),
            Parameter("rise while relieved", per_travel, 0.0, 1 / shortest),
            Parameter("gap", scales.unit(1, 0), 0.0, stroke) if scales.order == 0 else Parameter.absent("gap"),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a force that is relieved as a spring is; a better start knows the simpler law."""
        force, stroke = 0.1 * scales.force_rms, scales.stroke
        return [Start((force / way, 1 / way, 0.0, 0.0), 0) for way in (0.07 * stroke, 0.6 * stroke)]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the output is that of a motion."""
        return scales.kind in MOTION

    def describe(self, values: dict[str, float]) -> str:
        """Say what its numbers do."""
        return (
            f"{self.explanation} Where it is bent by w, its stiffness K becomes K (1 - a w) under further load and "
            "K (1 + b w) while it is relieved; a and b are the loss and the rise below."
        )

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Return the mean force over the step, with the bristle followed exactly for a constant velocity.

        m[j] is how far the bristle is bent, as a share of the farthest; half of the gap lies on each side of zero.
        """
        loss, rise, slack = p[i + 1], p[i + 2], 0.5 * p[i + 3]
        farthest = slack + 1.0 / (max(abs(loss), 0.1 * rise) + 1e-300)
        left = abs(v) * h
        side = math.copysign(1.0, v)
        bent = side * m[j] * farthest  # along the motion
        before = math.copysign(max(abs(bent) - slack, 0.0), bent)
        if bent < -slack:  # it is relieved until the gap is reached, or the substep is over
            force = -slack - bent
            whole = math.log1p(rise * force) / rise if rise > 0.0 else force
            way = min(left, whole)
            gone = -math.expm1(-rise * way)
            bent += force * gone + (gone / rise if rise > 0.0 else way)
            left -= way
        way = min(left, max(slack - bent, 0.0))  # across the gap
        bent += way
        left -= way
        if left > 0.0:
            gone = -math.expm1(min(-loss * left, 50.0))
            bent += (slack - bent) * gone + (gone / loss if loss != 0.0 else left)
        m[j] = side * bent / farthest
        return -p[i] * 0.5 * side * (before + math.copysign(max(abs(bent) - slack, 0.0), bent))
