"""Gravity on a pendulum."""

from __future__ import annotations

import math
from typing import ClassVar, final

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import ForceEffect, Parameter, Role, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS
from simgap.units import of_motion


def radians_per(unit: str) -> float:
    """Give the unit of an angle in rad; 0 for what is none."""
    motion = of_motion(unit)
    return motion.factor if motion.kind == "angle" else 0.0


@EFFECTS.register("gravity")
@final
class Gravity(ForceEffect):
    """f = -A sin(x - x0), x in rad; it takes the place of the linear spring."""

    name: ClassVar[str] = "gravity"
    title: ClassVar[str] = "gravity"
    explanation: ClassVar[str] = (
        "The weight of an arm or of an eccentric load: a torque that goes with the sine of the angle, pulls back below "
        "the horizontal like a spring and lets go above it."
    )
    reference: ClassVar[str] = "Spong, Hutchinson, Vidyasagar, Robot Modeling and Control, 2006, section 7.4"
    role: ClassVar[Role] = "force"
    replaces_spring: ClassVar[bool] = True
    moves_poles: ClassVar[bool] = True
    errors_grow: ClassVar[bool] = True
    shows_in: ClassVar[tuple[ViewName, ...]] = ("position",)
    confounders: ClassVar[dict[str, str]] = {
        "cubic_stiffness": "turn it beyond a quarter turn: a spring goes on pulling harder, gravity lets go",
        "quadratic_stiffness": "turn it beyond a quarter turn either way: gravity lets go on both sides",
        "position_torque": "turn it once around: gravity has one period per turn, cogging has many",
        "input_saturation": "hold it at several angles: gravity asks for most torque at the horizontal",
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the amplitude, the angle at which it hangs at rest, and the size of the angle's unit.

        A pendulum that swings faster than half the sampling frequency is not seen.
        """
        radian = radians_per(scales.y_unit) or 1.0
        turn = 2 * math.pi / radian
        return (
            Parameter("amplitude", scales.force_unit, 0.0, (math.pi / scales.dt) ** 2 / radian),
            Parameter("angle at rest", scales.y_unit, -0.5 * turn, 0.5 * turn),
            Parameter("radians per unit", "", radian, radian, fixed=True),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from weak to strong, hanging or standing out at angle zero."""
        radian = radians_per(scales.y_unit) or 1.0
        return [
            Start((level * scales.force_rms, angle / radian, radian))
            for level in (0.7, 3.0)
            for angle in (0.0, 0.5 * math.pi, -0.5 * math.pi)
        ]

    def as_spring(self, stiffness: float, scales: SignalScales) -> tuple[float, ...]:
        """Return the pendulum that hangs at zero and swings as fast."""
        radian = radians_per(scales.y_unit) or 1.0
        return stiffness / radian, 0.0, radian

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the output is an angle that moves by more than a twelfth of a turn."""
        return scales.kind == "position" and radians_per(scales.y_unit) * scales.x_max > 0.5

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Compute the torque at angle x."""
        return -p[i] * math.sin(p[i + 2] * (x - p[i + 1]))
