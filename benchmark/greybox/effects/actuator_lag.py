"""Lag of the actuator."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from scipy.signal import lfilter

from simgap.findings import ViewName
from simgap.greybox.effects.effect import InputEffect, Parameter, SignalScales, Start
from simgap.registry import EFFECTS


def lagged(u: np.ndarray, time_constant: float, h: float) -> np.ndarray:
    """The mean over each step of h seconds of a first-order lag of u [E, K]; it starts settled."""
    if time_constant <= 1e-3 * h:
        return u
    ratio = h / time_constant
    decay = math.exp(-ratio)
    after, _ = lfilter([1 - decay], [1.0, -decay], u, axis=1, zi=decay * u[:, :1])
    before = np.concatenate((u[:, :1], after[:, :-1]), axis=1)
    # From s at the start of a step towards u, the mean over it is u + (s - u) (1 - decay) / ratio.
    return u + (before - u) * (-math.expm1(-ratio) / ratio)


@EFFECTS.register("actuator_lag")
@final
class ActuatorLag(InputEffect):
    """T du'/dt = u - u'."""

    name: ClassVar[str] = "actuator_lag"
    title: ClassVar[str] = "lag of the actuator"
    explanation: ClassVar[str] = (
        "The actuator follows its command like a first-order filter: inductance of a winding, filling of a line, the "
        "inner loop of a drive."
    )
    reference: ClassVar[str] = "Isermann, Mechatronic Systems, 2005, ch. 5"
    place_in_chain: ClassVar[int] = 70
    linear: ClassVar[bool] = True
    shows_in: ClassVar[tuple[ViewName, ...]] = ("time since reversal", "frequency band")
    confounders: ClassVar[dict[str, str]] = {
        "input_delay": (
            "apply a step and sample fast: a lag starts at once, after a delay nothing moves at first; a short hold "
            "of the input excites the high frequencies that tell them apart"
        ),
        "sensor_lag": (
            "only a second sensor, or measuring what arrives from the actuator, tells the two apart in a machine that "
            "is otherwise linear: they are the same transfer function"
        ),
        "backlash": "repeat a slow triangle at half the speed: a lag fades, play stays as wide",
    }
    substeps: ClassVar[int] = 4

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """The time constant."""
        return (Parameter("time constant", "s", 0.0, 0.25 * scales.duration),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """From a sample to a good part of the record."""
        return [Start((n * scales.dt,)) for n in (0.7, 2.0, 5.0, 12.0) if n * scales.dt < 0.2 * scales.duration]

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """A first-order lag of p[0] seconds."""
        return lagged(u, float(p[0]), h)
