"""A valve that sticks and slips."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import InputEffect, Parameter, Start
from simgap.greybox.effects.kernels import stem
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


@EFFECTS.register("valve_stiction")
@final
class ValveStiction(InputEffect):
    """At rest until abs(u - u') > (S + J) / 2; then u' = u -+ (S - J) / 2 until u stands still or turns back."""

    name: ClassVar[str] = "valve_stiction"
    title: ClassVar[str] = "a sticking valve"
    explanation: ClassVar[str] = (
        "The stem stays where it is until the command has gone far enough, then slips with a jump, and follows until "
        "the command stands still or turns back: a packing that is too tight, a positioner that is too weak."
    )
    reference: ClassVar[str] = (
        "Choudhury, Thornhill, Shah, Modelling valve stiction, Control Engineering Practice 13, 2005, fig. 5"
    )
    place_in_chain: ClassVar[int] = 60
    contains: ClassVar[Mapping[str, tuple[int, ...]]] = {"backlash": (0,)}
    memory: ClassVar[int] = 1
    shows_in: ClassVar[tuple[ViewName, ...]] = ("time since reversal", "input")
    confounders: ClassVar[dict[str, str]] = {
        "backlash": (
            "stop the command and raise it again in small steps the same way: behind a gap the plant follows at once, "
            "a sticking valve waits and then jumps"
        ),
        "dead_zone": "move the command in small steps far from zero: a dead zone acts only around zero",
        "asymmetric_gain": "move the command one way only, in small steps: only a sticking valve jumps",
        "input_saturation": "keep the command well below its largest value: the valve still sticks, saturation is gone",
        "quantisation": (
            "move the command slowly there and back: a coarse reading steps at the same values on both ways, a "
            "sticking valve does not"
        ),
        "coulomb_friction": (
            "measure the position of the valve: if it follows the command smoothly, the friction is in the machine"
        ),
        "stribeck_friction": (
            "measure the position of the valve: if it follows the command smoothly, the friction is in the machine"
        ),
        "load_friction": (
            "measure the position of the valve: if it follows the command smoothly, the friction is in the machine"
        ),
        "hysteresis": (
            "move the command in small steps one way: a sticking valve answers with a jump after several of them, a "
            "hysteretic force gives way smoothly"
        ),
        "input_delay": (
            "repeat a slow triangle at half the speed: with a delay the loop of output over input becomes half as "
            "wide, with a sticking valve it stays as it was"
        ),
        "actuator_lag": (
            "repeat a slow triangle at half the speed: with a lag the loop of output over input becomes half as wide, "
            "with a sticking valve it stays as it was"
        ),
        "curved_input": (
            "raise a constant input in small steps and lower it again: with a sticking valve the way down differs "
            "from the way up, on a curved characteristic both are the same"
        ),
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the stick band S, the slip jump J as a share of it, and the time between commands."""
        return (
            Parameter("stick band", scales.u_unit, 0.0, 0.9 * (scales.u_high - scales.u_low)),
            Parameter("slip jump, share of the stick band", "", 0.0, 1.0),
            Parameter("time between commands", "s", scales.dt, scales.dt, fixed=True),
        )

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a narrow and a wide band, each with a small and a large jump."""
        reach = scales.u_high - scales.u_low
        return [Start((band * reach, jump, scales.dt)) for band in (0.08, 0.25) for jump in (0.3, 0.8)]

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Return the stem's position; before the record the command came from zero."""
        return ValveStiction.stem_from(u, p, h, np.zeros(len(u)), np.zeros(len(u)))

    @staticmethod
    def term_from(u: np.ndarray, p: np.ndarray, h: float, start: np.ndarray) -> np.ndarray:
        """Return the same of a stem at rest as far from the command as it sticks (-1, 1) or nearer."""
        return ValveStiction.stem_from(u, p, h, u[:, 0] + 0.5 * p[0] * (1 + p[1]) * start, u[:, 0])

    @staticmethod
    def stem_from(u: np.ndarray, p: np.ndarray, h: float, at: np.ndarray, before: np.ndarray) -> np.ndarray:
        """Return the position of a stem that stands somewhere, from the command before."""
        low, high = 0.5 * p[0] * (1 - p[1]), 0.5 * p[0] * (1 + p[1])
        return stem(u, low, high, max(1, round(p[2] / h)), at, before)

    @staticmethod
    def step(u, p, i, m, j, h, k):
        """Return the same, substep by substep; it keeps stem, direction, last command, and what is shown."""
        low = 0.5 * p[i] * (1 - p[i + 1])
        high = 0.5 * p[i] * (1 + p[i + 1])
        if k == 0:
            m[j] = u + high * m[j]
            m[j + 1] = 0.0
            m[j + 2] = u
        if k % int(max(1.0, round(p[i + 2] / h))) == 0:
            change = u - m[j + 2]
            away = u - m[j]
            m[j + 2] = u
            if change * m[j + 1] > 0.0:
                m[j] = u - math.copysign(low, m[j + 1])
                m[j + 3] = m[j]
            else:
                near = max(min(abs(change), 0.3 * (high - low)), 1e-300)  # SOFT
                share = min(max(0.5 + (abs(away) - high) / near, 0.0), 1.0)
                side = math.copysign(1.0, away)
                m[j + 3] = m[j] + share * (away - side * low)
                m[j + 1] = side if share >= 0.5 else 0.0
                if share >= 0.5:
                    m[j] = u - side * low
        return m[j + 3]

    @staticmethod
    def cells(p: np.ndarray, h: float) -> int:
        """Return how many numbers the step keeps."""
        return 4
