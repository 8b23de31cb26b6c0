"""Backlash in the drive."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.findings import ViewName
from simgap.greybox.effects.effect import InputEffect, Parameter, SignalScales, Start
from simgap.registry import EFFECTS


@EFFECTS.register("backlash")
@final
class Backlash(InputEffect):
    """u'(k) = min(max(u'(k-1), u(k) - w/2), u(k) + w/2), the play operator."""

    name: ClassVar[str] = "backlash"
    title: ClassVar[str] = "backlash in the drive"
    explanation: ClassVar[str] = (
        "After each reversal the input first crosses a gap before anything moves: play of gears, couplings, linkages "
        "or of a valve's stem."
    )
    reference: ClassVar[str] = (
        "Nordin and Gutman, Controlling mechanical systems with backlash, Automatica 38, 2002, sec. 2"
    )
    place_in_chain: ClassVar[int] = 60
    shows_in: ClassVar[tuple[ViewName, ...]] = ("time since reversal", "input")
    confounders: ClassVar[dict[str, str]] = {
        "hysteresis": (
            "trace slow loops of several sizes: play has straight flanks and a flat top, hysteresis is rounded"
        ),
        "input_delay": (
            "repeat a slow triangle at half the speed: a delay keeps its seconds, play keeps its width in units of "
            "the input"
        ),
        "actuator_lag": "repeat a slow triangle at half the speed: a lag fades, play stays as wide",
        "coulomb_friction": "stop and start in the same direction: play shows only after a reversal",
        "dead_zone": "reverse the input slowly far from zero: a dead zone acts around zero only",
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """The whole gap, in units of the input."""
        return (Parameter("gap", scales.u_unit, 0.0, 0.9 * (scales.u_high - scales.u_low)),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """From a narrow gap to a third of the travel."""
        return [Start((share * (scales.u_high - scales.u_low),)) for share in (0.04, 0.12, 0.3)]

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Play of width p[0]; before the record the input came from zero."""
        half, arrived = 0.5 * p[0], np.empty_like(u)
        held = np.zeros(len(u))
        low, high = u - half, u + half
        for k in range(u.shape[1]):
            held = np.minimum(np.maximum(held, low[:, k]), high[:, k])
            arrived[:, k] = held
        return arrived
