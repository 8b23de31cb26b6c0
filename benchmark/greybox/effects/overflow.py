"""A tank that overflows."""

from __future__ import annotations

from typing import ClassVar, final

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import ForceEffect, Parameter, Role, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("overflow")
@final
class Overflow(ForceEffect):
    """x <= H; what exceeds it spills, and a share of it into the next tank."""

    name: ClassVar[str] = "overflow"
    title: ClassVar[str] = "overflow"
    explanation: ClassVar[str] = (
        "A level cannot rise above the rim: the rest spills over, into the next tank or out of the plant, and the "
        "level falls again as soon as less flows in."
    )
    reference: ClassVar[str] = "Wigren and Schoukens, Three free data sets, ECC 2013 (cascaded tanks)"
    role: ClassVar[Role] = "rim"
    moves_poles: ClassVar[bool] = True
    instead_of_order: ClassVar[bool] = True
    shows_in: ClassVar[tuple[ViewName, ...]] = ("level", "amplitude")
    confounders: ClassVar[dict[str, str]] = {
        "sensor_saturation": (
            "stop the inflow while the reading stands at its limit: after an overflow the reading falls at once, that "
            "of a saturated sensor only when the level is back in range"
        ),
        "sqrt_outflow": "fill it slowly beyond the largest level so far: only an overflow stops the rise",
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the rims of the last tank and the one above it, and the share of a spill that the tank below gets."""
        last = Parameter("rim", scales.y_unit, 0.3 * scales.y_high, 1.5 * scales.y_high)
        if scales.order == 1:
            return (last,)
        above = Parameter(
            "rim of the upper tank, as the level it would feed", scales.y_unit, 0.2 * scales.y_high, 3 * scales.y_high
        )
        return (last, above, Parameter("share caught below", "", 0.0, 1.0))

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from rims that were just met: of the last tank, of the upper one, of both."""
        met, never = 0.98 * scales.y_high, 1.4 * scales.y_high
        if scales.order == 1:
            return [Start((met,)), Start((0.9 * met,))]
        return [
            Start((last, above, caught))
            for last, above, caught in ((met, 2 * never, 0.5), (never, met, 0.3), (never, met, 0.8), (met, met, 0.8))
        ]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the output is a level."""
        return scales.kind == "level" and scales.y_high > 0

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Return the rim of the last tank; the simulator takes the others from p[i + 1] and p[i + 2]."""
        return p[i]
