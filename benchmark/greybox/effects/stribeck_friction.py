"""Dry friction that falls as the motion starts."""

from __future__ import annotations

import math
from typing import ClassVar, final

from simgap.greybox.effects.effect import MOTION, ForceEffect, Parameter, Role, Scene, Start
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
    shows_in: ClassVar[tuple[str, ...]] = ("velocity", "sign of velocity")
    twins: ClassVar[dict[str, str]] = {
        "coulomb_friction": "creep through zero very slowly: with Coulomb friction alone the force does not fall "
        "as it starts to move",
        "dead_zone": "drive it at constant speed and change the input a little: a dead zone acts around zero input "
        "only",
        "hysteresis": "make very small strokes: a hysteretic force is elastic there, dry friction sticks",
    }

    def parameters(self, scene: Scene) -> tuple[Parameter, ...]:
        """The friction force in motion, what comes on top at standstill, and the velocity that it falls within."""
        return (
            Parameter("friction force", scene.force_unit, 0.0, 10 * scene.force),
            Parameter("rise at standstill", scene.force_unit, 0.0, 10 * scene.force),
            Parameter("Stribeck velocity", scene.rate_unit, 0.005 * scene.rate, scene.rate),
        )

    def starts(self, scene: Scene) -> list[Start]:
        """Several levels and velocities."""
        return [
            Start((level * scene.force, level * scene.force, share * scene.rate))
            for level in (0.1, 0.3)
            for share in (0.03, 0.1, 0.3)
        ]

    def suits(self, scene: Scene) -> bool:
        """Where something moves."""
        return scene.kind in MOTION

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """The force that dry friction can hold."""
        ratio = v / p[i + 2]
        return p[i] + p[i + 1] * math.exp(-ratio * ratio)
