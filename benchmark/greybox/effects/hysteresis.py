"""A hysteretic force."""

from __future__ import annotations

import math
from typing import ClassVar, final

from simgap.findings import ViewName
from simgap.greybox.effects.effect import MOTION, ForceEffect, Parameter, Role, SignalScales, Start
from simgap.registry import EFFECTS


@EFFECTS.register("hysteresis")
@final
class Hysteresis(ForceEffect):
    """f = -F z, d dz/dt = v - (abs(v) z + v abs(z)) / 2 (Bouc-Wen, n = 1, beta = gamma)."""

    name: ClassVar[str] = "hysteresis"
    title: ClassVar[str] = "hysteresis"
    explanation: ClassVar[str] = (
        "A force that depends on the way it came: it builds up over a certain travel after each reversal and then "
        "stays, at any speed. Creeping seals, wire ropes, piezo stacks, presliding friction."
    )
    reference: ClassVar[str] = "Bouc 1967, Wen 1976; Ismail, Ikhouane, Rodellar, Arch. Comput. Methods Eng. 16, 2009"
    role: ClassVar[Role] = "force"
    shows_in: ClassVar[tuple[ViewName, ...]] = ("time since reversal", "sign of velocity", "rate of change")
    confounders: ClassVar[dict[str, str]] = {
        "backlash": "trace slow loops of several sizes: hysteresis is rounded, play has straight flanks and a flat top",
        "coulomb_friction": "make very small strokes: a hysteretic force is elastic there, dry friction sticks",
        "stribeck_friction": "make very small strokes: a hysteretic force is elastic there, dry friction sticks",
        "actuator_lag": "repeat a slow triangle at half the speed: a lag fades, hysteresis stays as wide",
        "sensor_lag": "repeat a slow triangle at half the speed: a lag fades, hysteresis stays as wide",
        "input_delay": (
            "repeat a slow triangle at half the speed: the loop of a delay gets narrower, hysteresis stays as wide"
        ),
    }
    memory: ClassVar[int] = 1

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """The force after a long travel, and the travel in which it builds up."""
        return (
            Parameter("force", scales.force_unit, -10 * scales.force_rms, 10 * scales.force_rms),
            Parameter("travel", scales.unit(1, 0), 0.003 * scales.stroke, 2 * scales.stroke),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """From a short travel to a long one."""
        return [Start((0.1 * scales.force_rms, share * scales.stroke), amplitude=0) for share in (0.02, 0.07, 0.2, 0.6)]

    def applies_to(self, scales: SignalScales) -> bool:
        """Where something moves."""
        return scales.kind in MOTION

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """The mean force over the step, with z followed exactly for a constant velocity."""
        before, way = m[j], v * h / p[i + 1]
        z = before
        if way * z < 0:  # back towards zero: elastic
            back = min(abs(way), abs(z))
            z += math.copysign(back, way)
            way -= math.copysign(back, way)
        side = math.copysign(1.0, way)
        m[j] = side + (z - side) * math.exp(-abs(way))
        return -p[i] * 0.5 * (before + m[j])
