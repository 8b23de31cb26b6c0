"""A drive that gives less torque at large errors."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import InputEffect, Parameter, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("torque_foldback")
@final
class TorqueFoldback(InputEffect):
    """c' = c up to |e| = E; beyond, c' = c (E / |e|) (1 - f min(1, (|e| - E) / E)), e the error of the controller."""

    name: ClassVar[str] = "torque_foldback"
    title: ClassVar[str] = "torque that folds back at large errors"
    explanation: ClassVar[str] = (
        "The drive of a position controller protects itself: beyond some error its torque grows no further, and falls "
        "to a part of it at twice that error."
    )
    reference: ClassVar[str] = "Horowitz and Hill, The Art of Electronics, 2015, section 9.1.1.C (foldback limiting)"
    on_command: ClassVar[bool] = True
    place_in_chain: ClassVar[int] = 48
    shows_in: ClassVar[tuple[ViewName, ...]] = ("input", "amplitude", "velocity")
    confounders: ClassVar[dict[str, str]] = {
        "input_saturation": (
            "step the goal by different amounts: a saturated drive moves as fast after a large step as after a middle "
            "one, one that folds back moves more slowly"
        ),
        "rate_limit": (
            "step the goal with different loads: a limited speed is the same with each, torque that folds back moves a "
            "heavy load more slowly"
        ),
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the error from which torque grows no further, and the part of it that is lost at twice that error."""
        return (
            Parameter("error", scales.y_unit, 0.01 * scales.x_max, scales.x_max),
            Parameter("share lost", "", 0.0, 1.0),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from errors that are met seldom to one that is met often."""
        return [Start((share * scales.x_max, lost)) for share in (0.7, 0.4, 0.2, 0.08) for lost in (0.2, 0.7)]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether there is a controller inside."""
        return scales.commanded

    @staticmethod
    def command(c, error, t, h, p, i, m, j):
        """Return the command of a controller whose error is so large."""
        far = abs(error)
        if far <= p[i] or p[i] <= 0.0:
            return c
        return c * (p[i] / far) * (1.0 - p[i + 1] * min(1.0, (far - p[i]) / p[i]))

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Return the input as it is: without a controller there is no error."""
        return u

    @staticmethod
    def step(u, p, i, m, j, h, k):
        """Return the same, substep by substep."""
        return u
