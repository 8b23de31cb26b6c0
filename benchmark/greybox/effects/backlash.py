"""Backlash between the input and the plant."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import InputEffect, Parameter, Start
from simgap.greybox.effects.kernels import behind_gap
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("backlash")
@final
class Backlash(InputEffect):
    """u'(k) = min(max(u'(k-1), u(k) - w/2), u(k) + w/2), the play operator."""

    name: ClassVar[str] = "backlash"
    title: ClassVar[str] = "backlash in the drive"
    explanation: ClassVar[str] = (
        "After each reversal the input first crosses a gap before anything moves: play in gears, couplings, linkages "
        "or the stem of a valve."
    )
    reference: ClassVar[str] = (
        "Nordin and Gutman, Controlling mechanical systems with backlash, Automatica 38, 2002, sec. 2"
    )
    place_in_chain: ClassVar[int] = 60
    memory: ClassVar[int] = 1
    shows_in: ClassVar[tuple[ViewName, ...]] = ("time since reversal", "input")
    confounders: ClassVar[dict[str, str]] = {
        "hysteresis": (
            "trace slow loops of several sizes: backlash gives straight flanks and a flat top, hysteresis rounded ones"
        ),
        "input_delay": (
            "repeat a slow triangle at half the speed: with a delay the loop of output over input becomes half as "
            "wide, with backlash it stays as it was"
        ),
        "coulomb_friction": (
            "stop, and start again in the same direction: backlash shows only after a reversal, friction also after a "
            "stop"
        ),
        "dead_zone": "reverse the input slowly while it stays far from zero: a dead zone acts only around zero",
        "input_saturation": "keep the input well below its largest value: backlash is still there, saturation is not",
        "sensor_lag": (
            "repeat a slow triangle at half the speed: with a lag the loop of output over input becomes half as wide, "
            "with backlash it stays as it was"
        ),
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the whole gap, in units of the input."""
        return (Parameter("gap", scales.u_unit, 0.0, 0.9 * (scales.u_high - scales.u_low)),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a narrow gap to a third of the input's range."""
        return [Start((share * (scales.u_high - scales.u_low),)) for share in (0.04, 0.12, 0.3)]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the gap can be told from a dead zone: a force crosses it only where it changes its sign."""
        return scales.kind not in ("position", "velocity") or scales.u_low < 0 < scales.u_high

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Return u behind a gap of width p[0]; before the record the input came from zero."""
        return behind_gap(u, p[0], np.zeros(len(u)))

    @staticmethod
    def term_from(u: np.ndarray, p: np.ndarray, h: float, start: np.ndarray) -> np.ndarray:
        """Return u behind a gap in which each record begins at -1 (one side) to 1 (the other)."""
        return behind_gap(u, p[0], u[:, 0] + 0.5 * p[0] * start)

    @staticmethod
    def step(u, p, i, m, j, h, k):
        """Return the same, substep by substep."""
        if k == 0:
            m[j] = u + 0.5 * p[i] * m[j]
        m[j] = min(max(m[j], u - 0.5 * p[i]), u + 0.5 * p[i])
        return m[j]

    @staticmethod
    def cells(p: np.ndarray, h: float) -> int:
        """Return how many numbers the step keeps."""
        return 1
