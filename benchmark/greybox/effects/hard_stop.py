"""A mechanical end stop."""

from __future__ import annotations

from typing import ClassVar, final

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import ForceEffect, Parameter, Role, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("hard_stop")
@final
class HardStop(ForceEffect):
    """low <= x <= high; at an end the velocity is lost, and the stop holds whatever pushes further."""

    name: ClassVar[str] = "hard_stop"
    title: ClassVar[str] = "a mechanical end stop"
    explanation: ClassVar[str] = (
        "The motion ends at a stop, on one side or on both: there it stays, without bouncing, until the forces pull it "
        "back. The end of a screw or a cylinder, the limit of a joint, a valve on its seat."
    )
    reference: ClassVar[str] = (
        "Brogliato, Nonsmooth Mechanics, 2016, ch. 4 (Newton's law of impact with a coefficient of restitution of zero)"
    )
    role: ClassVar[Role] = "stop"
    shows_in: ClassVar[tuple[ViewName, ...]] = ("position", "amplitude")
    confounders: ClassVar[dict[str, str]] = {
        "sensor_saturation": (
            "drive it far against the limit and reverse: from a stop the reading turns back at once, that of a "
            "saturated sensor only when the machine is back in range"
        ),
        "input_saturation": (
            "push with a small input for long: a stop still ends the motion at the same place, a saturated actuator "
            "does not"
        ),
        "cubic_stiffness": (
            "push harder and harder: against a stiffening spring it still moves on, against a stop it does not"
        ),
        "quadratic_stiffness": (
            "push harder and harder: against a spring it still moves on, against a stop it does not"
        ),
        "position_torque": "push harder: a force that repeats over position is overcome, a stop is not",
        "gravity": "push harder: gravity is overcome, a stop is not",
        "curved_input": (
            "push with a small input for long: a stop still ends the motion at the same place, a curved actuator does "
            "not"
        ),
        "curved_sensor": (
            "look at the largest readings: at a stop they are all the same, behind a curved sensor they still differ"
        ),
        "absolute_sensor": "move slowly through zero: a rectified reading turns back there, a stop stands elsewhere",
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the lower and the upper end; each may lie out of reach."""
        low, high = scales.y_low, scales.y_high
        middle = 0.5 * (low + high)
        return (
            Parameter("lower end", scales.y_unit, 1.5 * low - 0.5 * high, middle),
            Parameter("upper end", scales.y_unit, middle, 1.5 * high - 0.5 * low),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start just inside the extreme readings, at either end or both."""
        span = scales.y_high - scales.y_low
        low, high = scales.y_low + 0.03 * span, scales.y_high - 0.03 * span
        return [Start((low, high)), Start((low, high + 0.43 * span)), Start((low - 0.43 * span, high))]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the output is the position of a body."""
        return scales.kind == "position" and scales.order == 2 and scales.y_high > scales.y_low

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Return the upper end; the simulator takes both from p[i] and p[i + 1]."""
        return p[i + 1]
