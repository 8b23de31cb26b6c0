"""Dry friction that falls as the motion starts."""

from __future__ import annotations

import math
from typing import ClassVar, final

from simgap.findings import ViewName
from simgap.greybox.effects.effect import MOTION, ForceEffect, Parameter, Role, SignalScales, Start
from simgap.registry import EFFECTS


@EFFECTS.register("stribeck_friction")
@final
class StribeckFriction(ForceEffect):
    """f = -(Fc + (Fs - Fc) exp(-(v/vs)^2)) sign(v)."""

    name: ClassVar[str] = "stribeck_friction"
    title: ClassVar[str] = "Stribeck friction"
    explanation: ClassVar[str] = (
        "Dry friction that is larger at standstill and falls within a small velocity, because a film of lubricant "
        "builds up: it breaks away with a jerk and creeps badly."
    )
    reference: ClassVar[str] = "Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30, 1994, sec. 2"
    role: ClassVar[Role] = "friction"
    contains: ClassVar[tuple[str, ...]] = ("coulomb_friction",)
    shows_in: ClassVar[tuple[ViewName, ...]] = ("velocity", "rate of change", "sign of velocity")
    confounders: ClassVar[dict[str, str]] = {
        "coulomb_friction": (
            "creep through zero very slowly: with Coulomb friction alone the force does not fall as it starts to move"
        ),
        "dead_zone": (
            "drive it at constant speed and change the input a little: a dead zone acts around zero input only"
        ),
        "hysteresis": "make very small strokes: a hysteretic force is elastic there, dry friction sticks",
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """The friction force in motion, what comes on top at standstill, and the velocity that it falls within."""
        return (
            Parameter("friction force", scales.force_unit, 0.0, 10 * scales.force_rms),
            Parameter("rise at standstill", scales.force_unit, 0.0, 10 * scales.force_rms),
            Parameter("Stribeck velocity", scales.velocity_unit, 0.005 * scales.v_max, scales.v_max),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Several levels and velocities."""
        return [
            Start((level * scales.force_rms, level * scales.force_rms, share * scales.v_max))
            for level in (0.1, 0.3)
            for share in (0.03, 0.1, 0.3)
        ]

    def applies_to(self, scales: SignalScales) -> bool:
        """Where something moves."""
        return scales.kind in MOTION

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """The force that dry friction can hold."""
        ratio = v / p[i + 2]
        return p[i] + p[i + 1] * math.exp(-ratio * ratio)
