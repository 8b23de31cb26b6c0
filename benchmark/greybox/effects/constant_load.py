"""A constant load."""

from __future__ import annotations

from typing import ClassVar, final

from simgap.findings import ViewName
from simgap.greybox.effects.effect import ForceEffect, Parameter, Role, SignalScales, Start
from simgap.registry import EFFECTS


@EFFECTS.register("constant_load")
@final
class ConstantLoad(ForceEffect):
    """f = F0."""

    name: ClassVar[str] = "constant_load"
    title: ClassVar[str] = "constant load"
    explanation: ClassVar[str] = (
        "A force that is always there and always the same: weight, a preloaded spring, the offset of an amplifier."
    )
    reference: ClassVar[str] = "Isermann, Mechatronic Systems, 2005, ch. 4"
    role: ClassVar[Role] = "force"
    linear: ClassVar[bool] = True
    shows_in: ClassVar[tuple[ViewName, ...]] = ("offset", "position", "time since the start")
    confounders: ClassVar[dict[str, str]] = {
        "asymmetric_gain": (
            "let it run without input, and compare steps up and down of several sizes: a load errs by the same amount "
            "each time"
        ),
        "sensor_bias": "turn the machine by hand or support the load: the reading of a biased sensor stays off",
        "quadratic_stiffness": "hold it at several positions: a load is the same at all of them",
        "sensor_drift": "record for longer: a drift goes on growing",
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """The force."""
        return (Parameter("force", scales.force_unit, -20 * scales.force_rms, 20 * scales.force_rms),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Either way."""
        return [Start((0.1 * scales.force_rms,), amplitude=0)]

    def applies_to(self, scales: SignalScales) -> bool:
        """Where the plain model has no free operating point."""
        return scales.kind in ("position", "velocity")

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """p[i] everywhere."""
        return p[i]
