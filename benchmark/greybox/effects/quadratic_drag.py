"""A drag that grows with the square of the velocity."""

from __future__ import annotations

from typing import ClassVar, final

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import MOTION, ForceEffect, Parameter, Role, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("quadratic_drag")
@final
class QuadraticDrag(ForceEffect):
    """f = -c v abs(v)."""

    name: ClassVar[str] = "quadratic_drag"
    title: ClassVar[str] = "quadratic drag"
    explanation: ClassVar[str] = (
        "A force against the motion that grows with the square of the velocity: air or water around the body, oil "
        "through an orifice."
    )
    reference: ClassVar[str] = "Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2011, ch. 6"
    role: ClassVar[Role] = "force"
    shows_in: ClassVar[tuple[ViewName, ...]] = ("velocity", "rate of change", "amplitude")
    confounders: ClassVar[dict[str, str]] = {
        "stribeck_friction": (
            "run at several constant speeds: drag grows with the square of the speed, Stribeck friction falls with it"
        ),
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the drag coefficient."""
        return (
            Parameter(
                "drag",
                scales.force_over(v=2),
                0.0,
                100 * scales.force_rms / scales.v_max**2,
            ),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a small drag."""
        return [Start((0.1 * scales.force_rms / scales.v_max**2,), amplitude=0)]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the output is that of a motion."""
        return scales.kind in MOTION

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Return -c v |v|."""
        return -p[i] * v * abs(v)
