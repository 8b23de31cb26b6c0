"""Dry friction of constant size."""

from __future__ import annotations

from typing import ClassVar, final

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import MOTION, ForceEffect, Parameter, Role, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("coulomb_friction")
@final
class CoulombFriction(ForceEffect):
    """f = -Fc sign(v); at standstill whatever holds it, up to Fc."""

    name: ClassVar[str] = "coulomb_friction"
    title: ClassVar[str] = "Coulomb friction"
    explanation: ClassVar[str] = (
        "Dry friction: a force of constant size against the motion, which also holds the machine where it stands "
        "until the drive exceeds it."
    )
    reference: ClassVar[str] = (
        "Armstrong-Helouvry, Dupont, Canudas de Wit, A survey of models, analysis tools and compensation methods for "
        "the control of machines with friction, Automatica 30, 1994"
    )
    role: ClassVar[Role] = "friction"
    shows_in: ClassVar[tuple[ViewName, ...]] = ("sign of velocity", "velocity", "rate of change", "time since reversal")
    confounders: ClassVar[dict[str, str]] = {
        "stribeck_friction": (
            "creep through zero very slowly: Stribeck friction falls as the motion starts, Coulomb friction does not"
        ),
        "dead_zone": (
            "let it run, then set the input to zero: friction brakes it to a stop, behind a dead zone it coasts as the "
            "linear model does"
        ),
        "hysteresis": "make very small strokes: a hysteretic force pulls back like a spring, dry friction just sticks",
        "quadratic_drag": (
            "run at two constant speeds, one twice the other: drag becomes four times as large, dry friction stays the "
            "same"
        ),
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the friction force."""
        return (Parameter("friction force", scales.force_unit, 0.0, 10 * scales.force_rms),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from little friction to what nearly holds the drive."""
        return [Start((share * scales.force_rms,)) for share in (0.05, 0.2, 0.5)]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the output is that of a motion."""
        return scales.kind in MOTION

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Return the force that dry friction can hold."""
        return p[i]
