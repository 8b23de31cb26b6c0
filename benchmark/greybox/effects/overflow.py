"""Overflow of a tank."""

from __future__ import annotations

from typing import ClassVar, final

from simgap.findings import ViewName
from simgap.greybox.effects.effect import ForceEffect, Parameter, Role, SignalScales, Start
from simgap.registry import EFFECTS


@EFFECTS.register("overflow")
@final
class Overflow(ForceEffect):
    """x <= H; what exceeds it spills, and a share of it into the next tank."""

    name: ClassVar[str] = "overflow"
    title: ClassVar[str] = "overflow"
    explanation: ClassVar[str] = (
        "A level cannot rise above the rim: the rest spills over, into the next tank or out of the plant, and as "
        "soon as less "
        "comes in the level falls again."
    )
    reference: ClassVar[str] = "Wigren and Schoukens, Three free data sets, ECC 2013 (cascaded tanks)"
    role: ClassVar[Role] = "rim"
    moves_poles: ClassVar[bool] = True
    instead_of_order: ClassVar[bool] = True
    shows_in: ClassVar[tuple[ViewName, ...]] = ("level", "amplitude")
    confounders: ClassVar[dict[str, str]] = {
        "sensor_saturation": (
            "watch how it comes back from the limit: an overflow leaves it at once, a saturated sensor only when the "
            "level is back in range"
        ),
        "sqrt_outflow": "fill it slowly past the largest level: only an overflow stops the rise",
        "input_saturation": (
            "raise the largest input step by step: an overflow stops the level, however slowly it is filled"
        ),
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """The rims of the last tank and of those above it, and the share of a spill that the next tank catches."""
        last = Parameter("rim", scales.y_unit, 0.3 * scales.y_high, 1.5 * scales.y_high)
        if scales.order == 1:
            return (last,)
        above = Parameter(
            "rim of the upper tank, as the level it would feed", scales.y_unit, 0.2 * scales.y_high, 3 * scales.y_high
        )
        return (last, above, Parameter("share caught below", "", 0.0, 1.0))

    def starts(self, scales: SignalScales) -> list[Start]:
        """Rims that were just met: of the last tank, of the upper one, of both."""
        met, never = 0.98 * scales.y_high, 1.4 * scales.y_high
        if scales.order == 1:
            return [Start((met,)), Start((0.9 * met,))]
        return [
            Start((last, above, caught))
            for last, above, caught in ((met, 2 * never, 0.5), (never, met, 0.3), (never, met, 0.8), (met, met, 0.8))
        ]

    def applies_to(self, scales: SignalScales) -> bool:
        """Where a level is measured."""
        return scales.kind == "level" and scales.y_high > 0

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """The rim of the last tank; the simulator takes the rest from p[i + 1], p[i + 2]."""
        return p[i]
