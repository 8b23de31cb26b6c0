"""Dry friction that falls as the motion starts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, final

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import MOTION, ForceEffect, Parameter, Role, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("stribeck_friction")
@final
class StribeckFriction(ForceEffect):
    """f = -(Fc + (Fs - Fc) exp(-(v/vs)^2)) sign(v)."""

    name: ClassVar[str] = "stribeck_friction"
    title: ClassVar[str] = "Stribeck friction"
    explanation: ClassVar[str] = (
        "Dry friction that is largest at standstill and falls within a small velocity, as a film of lubricant builds "
        "up: the machine breaks away with a jerk and creeps unevenly."
    )
    reference: ClassVar[str] = "Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30, 1994, sec. 2"
    role: ClassVar[Role] = "friction"
    contains: ClassVar[Mapping[str, tuple[int, ...]]] = {"coulomb_friction": (0,)}
    shows_in: ClassVar[tuple[ViewName, ...]] = ("velocity", "rate of change", "sign of velocity")

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the friction force in motion, its rise at standstill, and the velocity within which it falls."""
        return (
            Parameter("friction force", scales.force_unit, 0.0, 10 * scales.force_rms),
            Parameter("rise at standstill", scales.force_unit, 0.0, 10 * scales.force_rms),
            Parameter("Stribeck velocity", scales.velocity_unit, 0.005 * scales.v_max, scales.v_max),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from several forces and Stribeck velocities."""
        return [
            Start((level * scales.force_rms, level * scales.force_rms, share * scales.v_max))
            for level in (0.1, 0.3)
            for share in (0.03, 0.1, 0.3)
        ]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the output is that of a motion."""
        return scales.kind in MOTION

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Return the force that dry friction can hold."""
        ratio = v / p[i + 2]
        return p[i] + p[i + 1] * math.exp(-ratio * ratio)
