"""A tank that empties by gravity."""

from __future__ import annotations

import math
from typing import ClassVar, final

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import ForceEffect, Parameter, Role, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("sqrt_outflow")
@final
class SqrtOutflow(ForceEffect):
    """q = a ((1 - s) x + s sqrt(x X)), X the mid level: s = 1 is Torricelli's law."""

    name: ClassVar[str] = "sqrt_outflow"
    title: ClassVar[str] = "square-root outflow"
    explanation: ClassVar[str] = (
        "A tank empties through a hole in proportion to the square root of its level, not to the level itself."
    )
    reference: ClassVar[str] = "Torricelli 1643; Wigren and Schoukens, Three free data sets, ECC 2013 (cascaded tanks)"
    role: ClassVar[Role] = "outflow"
    moves_poles: ClassVar[bool] = True
    instead_of_order: ClassVar[bool] = True
    shows_in: ClassVar[tuple[ViewName, ...]] = ("level", "amplitude")

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the share of the square root, and the level at which both laws agree."""
        middle = max(0.5 * (scales.y_low + scales.y_high), 0.05 * scales.y_high)
        return (
            Parameter("square-root share", "", 0.0, 1.0),
            Parameter("mid level", scales.y_unit, middle, middle, fixed=True),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a weak and from a strong square root."""
        return [
            Start((share, max(0.5 * (scales.y_low + scales.y_high), 0.05 * scales.y_high))) for share in (0.4, 0.95)
        ]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the output is a level."""
        return scales.kind == "level" and scales.y_high > 0

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Return what flows out at level x on top of x, in units of the linear rate."""
        return p[i] * (math.sqrt(x * p[i + 1]) - x) if x > 0.0 else 0.0
