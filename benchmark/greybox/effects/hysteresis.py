"""A hysteretic force."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from jaxtyping import Float

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.bouc_wen import BoucWen
from simgap.greybox.effects.effect import MOTION, Effect, ForceEffect, Parameter, Role, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("hysteresis")
@final
class Hysteresis(ForceEffect):
    """f = -F z, d dz/dt = v - (abs(v) z + v abs(z)) / 2 (Bouc-Wen, n = 1, beta = gamma)."""

    name: ClassVar[str] = BoucWen.name
    title: ClassVar[str] = BoucWen.title
    explanation: ClassVar[str] = BoucWen.explanation
    reference: ClassVar[str] = BoucWen.reference
    role: ClassVar[Role] = BoucWen.role
    refined: ClassVar[type[Effect] | None] = BoucWen
    shows_in: ClassVar[tuple[ViewName, ...]] = BoucWen.shows_in
    confounders: ClassVar[dict[str, str]] = BoucWen.confounders
    memory: ClassVar[int] = 1

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the force after a long travel, the travel in which it builds up, and the gap that it first crosses.

        A gap is looked for where the motion is imposed; in a drive, backlash is an effect of its own.
        """
        least = 0 if scales.order == 0 else -10  # a motion that is imposed is braked, never driven
        return (
            Parameter("force", scales.force_unit, least * scales.force_rms, 10 * scales.force_rms),
            Parameter("travel", scales.unit(1, 0), 0.003 * scales.stroke, 2 * scales.stroke),
            Parameter("gap", scales.unit(1, 0), 0.0, scales.stroke) if scales.order == 0 else Parameter.absent("gap"),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a short travel to a long one, without a gap and with a wide one."""
        force, stroke = 0.1 * scales.force_rms, scales.stroke
        gaps = (0.0, 0.3) if scales.order == 0 else (0.0,)
        return [Start((force, share * stroke, gap * stroke), 0) for share in (0.02, 0.07, 0.2, 0.6) for gap in gaps]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the output is that of a motion."""
        return scales.kind in MOTION

    def as_refined(self, values: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 4"]:
        """Return the numbers of the same law by its stiffness and what that loses and gains on the way."""
        force, travel, gap = values
        return np.array([force / travel, 1 / travel, 0.0, gap])

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Return the mean force over the step, with the bristle followed exactly for a constant velocity.

        m[j] is how far the bristle is bent, as a share of the farthest; half of the gap lies on each side of zero.
        """
        slack = 0.5 * p[i + 2] / p[i + 1]
        travel = abs(v) * h / p[i + 1]
        side = math.copysign(1.0, v)
        bent = side * m[j] * (1.0 + slack)  # along the motion
        before = math.copysign(max(abs(bent) - slack, 0.0), bent)
        free = min(travel, max(slack - bent, 0.0))  # back to the middle, and across the gap: elastic
        bent += free
        if travel > free:
            bent = slack + 1.0 - (1.0 + slack - bent) * math.exp(free - travel)
        m[j] = side * bent / (1.0 + slack)
        return -p[i] * 0.5 * side * (before + math.copysign(max(abs(bent) - slack, 0.0), bent))
