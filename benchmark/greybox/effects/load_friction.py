"""Friction that grows with the load."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import MOTION, ForceEffect, Parameter, Role, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("load_friction")
@final
class LoadFriction(ForceEffect):
    """f = -(Fc + k |drive - e d v - load|) sign(v): the load is what spring, gravity and other forces put on the drive.

    e d v is what the motor loses to its back-EMF before its teeth carry anything: a share e of the damping d.
    """

    name: ClassVar[str] = "load_friction"
    title: ClassVar[str] = "friction that grows with the load"
    explanation: ClassVar[str] = (
        "Dry friction in proportion to the force that the transmission carries, on top of a constant part: teeth and "
        "bearings of a gear are pressed together harder the more it works, so a loaded joint holds where it stands."
    )
    reference: ClassVar[str] = (
        "Duclusaud, Passault, Padois, Ly, Extended friction models for the physics simulation of servo actuators, ICRA "
        "2025 (arXiv 2410.08650), eq. of model M3"
    )
    role: ClassVar[Role] = "friction"
    memory: ClassVar[int] = 2
    contains: ClassVar[Mapping[str, tuple[int, ...]]] = {"coulomb_friction": (0,)}
    shows_in: ClassVar[tuple[ViewName, ...]] = ("sign of velocity", "velocity", "rate of change", "time since reversal")
    of_one_mass: ClassVar[bool] = True
    confounders: ClassVar[dict[str, str]] = {
        "coulomb_friction": "repeat a slow stroke with twice the load: friction that grows with it doubles as well",
        "stribeck_friction": "repeat a slow stroke with twice the load: Stribeck friction stays the same",
        "quadratic_drag": (
            "run at two constant speeds, one twice the other: drag becomes four times as large, friction stays the same"
        ),
        "dead_zone": (
            "hold a load and lower the input slowly: friction that grows with the load keeps it where it stands until "
            "the input has fallen by a share of itself"
        ),
        "hysteresis": "make very small strokes: a hysteretic force pulls back like a spring, dry friction just sticks",
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the constant friction force, the share of the load that adds to it, and that of back-EMF in damping.

        Where a motion is imposed nothing is lost to damping, and the back-EMF of a known machine is told.
        """
        back_emf = "share of back-EMF in the damping"
        known = scales.order == 0 or bool(scales.force)
        return (
            Parameter("friction force", scales.force_unit, 0.0, 10 * scales.force_rms),
            Parameter("share of the load", "", 0.0, 0.95),
            Parameter.absent(back_emf) if known else Parameter(back_emf, "", 0.0, 1.0),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from shares of the load with and without a constant part."""
        *_, back_emf = self.parameters(scales)
        levels = (0.0, 0.1 * scales.force_rms)
        return [Start((level, share, 0.5 * back_emf.high)) for level in levels for share in (0.1, 0.3, 0.6)]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the output is that of a motion."""
        return scales.kind in MOTION

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Return the force that dry friction can hold; m[j] is the load, m[j + 1] what damping takes."""
        return p[i] + p[i + 1] * abs(m[j] - p[i + 2] * m[j + 1])
