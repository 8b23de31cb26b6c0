"""A spring with a cubic characteristic."""

from __future__ import annotations

from typing import ClassVar, final

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import ForceEffect, Parameter, Role, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("cubic_stiffness")
@final
class CubicStiffness(ForceEffect):
    """f = -k x^3."""

    name: ClassVar[str] = "cubic_stiffness"
    title: ClassVar[str] = "cubic stiffness"
    explanation: ClassVar[str] = (
        "A spring that gets stiffer (or softer) the further it is stretched, in both directions: a clamped beam, "
        "rubber near its limit, a membrane. Of a temperature, a loss of heat that grows faster than it: radiation."
    )
    reference: ClassVar[str] = "Kovacic and Brennan, The Duffing Equation, 2011, ch. 2"
    role: ClassVar[Role] = "force"
    instead_of_order: ClassVar[bool] = True
    shows_in: ClassVar[tuple[ViewName, ...]] = ("position", "value", "amplitude")
    confounders: ClassVar[dict[str, str]] = {
        "position_torque": (
            "travel further: a force that repeats over position turns back, a cubic spring pulls harder and harder"
        ),
        "input_saturation": (
            "hold constant inputs up to the largest: with saturation the output stops growing at one input, with a "
            "stiffening spring it grows more and more slowly"
        ),
        "quadratic_drag": "hold it at rest away from the middle: a spring still pulls, drag does not",
        "quadratic_stiffness": (
            "hold it equally far from the middle on both sides: a cubic spring pulls back from both, a quadratic one "
            "pulls in the same direction on both"
        ),
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the coefficient k."""
        return (
            Parameter(
                "stiffness",
                scales.force_over(x=3),
                -100 * scales.force_rms / scales.x_max**3,
                100 * scales.force_rms / scales.x_max**3,
            ),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a weak spring."""
        return [Start((0.1 * scales.force_rms / scales.x_max**3,), amplitude=0)]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the simulation has a position or, of an output of another kind, a state."""
        return scales.kind == "position" or (scales.kind == "other" and scales.order > 0)

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Return the pull of the spring, -k x^3."""
        return -p[i] * x * x * x
