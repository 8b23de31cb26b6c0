"""A force that is a sine of position."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import ForceEffect, Parameter, Role, Start
from simgap.greybox.effects.gravity import radians_per
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS

MOST_PERIODS = 40  # in a travel
NEARLY = 0.05  # of a turn, from which a period may differ that is one


@EFFECTS.register("position_torque")
@final
class PositionTorque(ForceEffect):
    """f = A sin(2 pi x / X + phase)."""

    name: ClassVar[str] = "position_torque"
    title: ClassVar[str] = "a force that repeats over position"
    explanation: ClassVar[str] = (
        "A force that rises and falls along the travel, at whatever time and speed: cogging of a motor's magnets, an "
        "eccentric mass, a cable or hose that pulls."
    )
    reference: ClassVar[str] = (
        "Proca et al., Analytical model for permanent magnet motors with surface mounted magnets, IEEE Trans. "
        "Energy Conversion 18, 2003"
    )
    role: ClassVar[Role] = "force"
    many_valleys: ClassVar[bool] = True
    shows_in: ClassVar[tuple[ViewName, ...]] = ("position", "value")
    confounders: ClassVar[dict[str, str]] = {
        "quadratic_stiffness": (
            "travel further: a force that repeats over position turns back, a spring pulls harder and harder"
        ),
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the amplitude, the length of one period, and the phase at position zero."""
        return (
            Parameter("amplitude", scales.force_unit, -20 * scales.force_rms, 20 * scales.force_rms),
            Parameter("period", scales.y_unit, 2 * scales.x_max / MOST_PERIODS, 2 * scales.x_max),
            Parameter("phase", "rad", -20.0, 20.0),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from all numbers of periods that a travel may hold, half a period apart, each with two phases.

        A fit that begins further off is out of phase at the ends of the travel, and finds nothing.
        """
        return [
            Start((0.1 * scales.force_rms, 4 * scales.x_max / halves, phase), amplitude=0)
            for halves in range(3, 2 * MOST_PERIODS + 1)  # of a period
            for phase in (0.0, 1.57)
        ]

    def simpler(self, values: np.ndarray, scales: SignalScales) -> Mapping[str, np.ndarray]:
        """Return gravity where the force repeats with every turn of an angle."""
        radian = radians_per(scales.y_unit)
        amplitude, period, phase = values
        if abs(radian * period - 2 * math.pi) > NEARLY * 2 * math.pi:
            return {}
        hangs = math.remainder(-phase - (math.pi if amplitude > 0 else 0.0), 2 * math.pi)
        return {"gravity": np.array([abs(amplitude), hangs / radian, radian])}

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the simulation has a position."""
        return scales.kind == "position"

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Return A sin(2 pi x / X + phase)."""
        return p[i] * math.sin(6.283185307179586 * x / p[i + 1] + p[i + 2])
