"""A constant force on the plant."""

from __future__ import annotations

from typing import ClassVar, final

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import ForceEffect, Parameter, Role, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("constant_load")
@final
class ConstantLoad(ForceEffect):
    """f = F0."""

    name: ClassVar[str] = "constant_load"
    title: ClassVar[str] = "a constant load"
    explanation: ClassVar[str] = (
        "A force that is always there and always the same: weight, a preloaded spring, the offset of an amplifier."
    )
    reference: ClassVar[str] = "Isermann, Mechatronic Systems, 2005, ch. 4"
    role: ClassVar[Role] = "force"
    linear: ClassVar[bool] = True
    of_one_mass: ClassVar[bool] = True
    # The mean input that holds it drives an axis away that is modelled without it.
    may_move_poles_of: ClassVar[tuple[str, ...]] = ("position",)
    shows_in: ClassVar[tuple[ViewName, ...]] = ("offset", "position", "time since the start")
    confounders: ClassVar[dict[str, str]] = {
        "sensor_bias": (
            "take the load off, or hold the machine at a known position: the reading of a biased sensor is still off"
        ),
        "quadratic_stiffness": "hold it at several positions: a constant load is the same at all of them",
        "sensor_drift": "hold the machine at a known position: the reading of a drifting sensor still moves",
        "position_torque": "hold it at several positions: a constant load is the same at all of them",
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the force."""
        largest = max(20 * scales.force_rms, 3 * abs(self._held(scales)))
        return (Parameter("force", scales.force_unit, -largest, largest),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a small force, its size and sign estimated then; far from zero, from one that holds it there."""
        small = [Start((0.1 * scales.force_rms,), amplitude=0)]
        return [*small, Start((self._held(scales),))] if scales.y_low * scales.y_high > 0 else small

    @staticmethod
    def _held(scales: SignalScales) -> float:
        """Estimate the force that holds a plant with a spring where it is, from what moves it about there."""
        return scales.force_rms * 0.5 * (scales.y_low + scales.y_high) / (scales.y_rms or 1.0)

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the plain model lacks an operating point that is fitted."""
        return scales.at_zero

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Return the force p[i]."""
        return p[i]
