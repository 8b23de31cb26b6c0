"""A quadratic spring."""

from __future__ import annotations

from typing import ClassVar, final

from simgap.findings import ViewName
from simgap.greybox.effects.effect import ForceEffect, Parameter, Role, SignalScales, Start
from simgap.registry import EFFECTS


@EFFECTS.register("quadratic_stiffness")
@final
class QuadraticStiffness(ForceEffect):
    """f = -k x^2."""

    name: ClassVar[str] = "quadratic_stiffness"
    title: ClassVar[str] = "quadratic stiffness"
    explanation: ClassVar[str] = (
        "A spring that pulls harder on one side than on the other: a preloaded or one-sided suspension, a magnet's "
        "pull."
    )
    reference: ClassVar[str] = "Kovacic and Brennan, The Duffing Equation, 2011, ch. 2"
    role: ClassVar[Role] = "force"
    shows_in: ClassVar[tuple[ViewName, ...]] = ("position", "value", "amplitude")
    confounders: ClassVar[dict[str, str]] = {
        "constant_load": "hold it at several positions: a load is the same at all of them",
        "asymmetric_gain": "hold constant inputs of several sizes both ways: an unequal gain gives two straight lines",
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """The coefficient."""
        return (
            Parameter(
                "stiffness",
                scales.unit(-1, -scales.order),
                -100 * scales.force_rms / scales.x_max**2,
                100 * scales.force_rms / scales.x_max**2,
            ),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """A weak spring."""
        return [Start((0.1 * scales.force_rms / scales.x_max**2,), amplitude=0)]

    def applies_to(self, scales: SignalScales) -> bool:
        """Where a position is known."""
        return scales.kind == "position" or (scales.kind == "other" and scales.order > 1)

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """The spring's pull."""
        return -p[i] * x * x
