"""A spring with a quadratic characteristic."""

from __future__ import annotations

from typing import ClassVar, final

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import ForceEffect, Parameter, Role, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("quadratic_stiffness")
@final
class QuadraticStiffness(ForceEffect):
    """f = -k x^2."""

    name: ClassVar[str] = "quadratic_stiffness"
    title: ClassVar[str] = "quadratic stiffness"
    explanation: ClassVar[str] = (
        "A spring that gets stiffer in one direction and softer in the other: a preloaded or one-sided suspension, the "
        "pull of a magnet. Of a temperature, a loss of heat that grows faster than it."
    )
    reference: ClassVar[str] = "Kovacic and Brennan, The Duffing Equation, 2011, ch. 2"
    role: ClassVar[Role] = "force"
    instead_of_order: ClassVar[bool] = True
    shows_in: ClassVar[tuple[ViewName, ...]] = ("position", "value", "amplitude")

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the coefficient k."""
        return (
            Parameter(
                "stiffness",
                scales.force_over(x=2),
                -100 * scales.force_rms / scales.x_max**2,
                100 * scales.force_rms / scales.x_max**2,
            ),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a weak spring."""
        return [Start((0.1 * scales.force_rms / scales.x_max**2,), amplitude=0)]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the simulation has a position or, of an output of another kind, a state."""
        return scales.kind == "position" or (scales.kind == "other" and scales.order > 0)

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Return the pull of the spring, -k x^2."""
        return -p[i] * x * x
