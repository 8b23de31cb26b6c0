"""An output that returns to zero no faster than at a certain rate."""

from __future__ import annotations

from typing import ClassVar, final

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import ForceEffect, Parameter, Role, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS

SLOW, FREE = (0.25, 0.6), 5.0  # of a large rate: limits that are met, and one that is out of reach


@EFFECTS.register("limited_braking")
@final
class LimitedBraking(ForceEffect):
    """-dx/dt <= max(0, r0 + (r1 - r0) x / X) at x > 0, and towards zero from below likewise.

    x is the output: of a body its velocity. r0 is how fast it returns near zero, r1 at its largest value X.
    """

    name: ClassVar[str] = "limited_braking"
    title: ClassVar[str] = "limited braking"
    explanation: ClassVar[str] = (
        "The output returns towards zero no faster than at a certain rate, whatever the drive asks, and moves away "
        "from it as before: a motor that coasts between pulses or brakes with a limited current, a car without brakes, "
        "a freewheel, a capacitor behind a diode, a vessel behind a check valve."
    )
    reference: ClassVar[str] = (
        "Erickson and Maksimovic, Fundamentals of Power Electronics, 2001, ch. 5 (the diode blocks, and the load alone "
        "discharges the capacitor)"
    )
    role: ClassVar[Role] = "braking"
    of_one_mass: ClassVar[bool] = True
    may_move_poles_of: ClassVar[tuple[str, ...]] = ("velocity", "other")
    shows_in: ClassVar[tuple[ViewName, ...]] = ("rate of change", "velocity", "time since reversal", "amplitude")
    confounders: ClassVar[dict[str, str]] = {
        "rate_limit": (
            "switch the drive off altogether: with limited braking the output returns hardly slower than before, "
            "behind a slow actuator at another rate"
        ),
        "asymmetric_gain": (
            "hold each input until the output is steady: a gain that depends on the sign shows there, limited braking "
            "does not"
        ),
        "quadratic_drag": (
            "switch the drive off at several outputs: drag slows a fast motion much more, with limited braking it "
            "rises faster than it falls at every speed"
        ),
        "coulomb_friction": (
            "raise the input slowly from zero: dry friction holds until it is overcome, limited braking changes nothing"
        ),
        "stribeck_friction": (
            "raise the input slowly from zero: dry friction holds until it is overcome, limited braking changes nothing"
        ),
        "load_friction": (
            "raise the input slowly from zero: friction holds until it is overcome, limited braking changes nothing"
        ),
        "hysteresis": (
            "repeat a slow triangle at half the speed: a slow return needs no brakes, hysteresis stays as it was"
        ),
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the fastest returns from the largest output and near zero, and the largest output."""
        rate, largest = scales.unit(1, -1 - (scales.kind == "velocity")), _largest(scales)
        fastest = 2 * FREE * _rate(scales)
        return (
            Parameter("fastest return from the largest output", rate, 0.0, fastest),
            Parameter("fastest return near zero", rate, -fastest, fastest),
            Parameter("largest output", scales.y_unit, largest, largest, fixed=True),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a return at one rate, and from one in proportion to the output."""
        largest = _largest(scales)
        slow = [share * _rate(scales) for share in SLOW]
        return [Start((rate, near_zero * rate, largest)) for rate in slow for near_zero in (1.0, 0.0)]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the output is a velocity, or no motion at all, and is ever away from zero."""
        return (
            _rate(scales) > 0
            and _largest(scales) > 0
            and (scales.order == 1 if scales.kind == "velocity" else scales.kind == "other" and scales.order > 0)
        )

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Return how fast it may return from x."""
        return max(p[i + 1] + (p[i] - p[i + 1]) * abs(x) / p[i + 2], 0.0)


def _largest(scales: SignalScales) -> float:
    return max(abs(scales.y_low), abs(scales.y_high))


def _rate(scales: SignalScales) -> float:
    """Return a large rate of the output."""
    return scales.v_max if scales.order > 1 else scales.force_rms
