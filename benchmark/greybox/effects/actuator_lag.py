"""A first-order lag of the actuator."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar, final

import numpy as np
from scipy.signal import lfilter

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import Effect, InputEffect, Parameter, Start
from simgap.greybox.effects.in_motion import InMotion
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


def lagged(u: np.ndarray, time_constant: float, h: float, past: np.ndarray) -> np.ndarray:
    """Return the mean over each step of h seconds of u [E, K] behind a first-order lag that starts at `past` [E]."""
    if time_constant <= 1e-3 * h:
        return u
    ratio = h / time_constant
    decay = math.exp(-ratio)
    after, _ = lfilter([1 - decay], [1.0, -decay], u, axis=1, zi=decay * past[:, None])
    before = np.concatenate((past[:, None], after[:, :-1]), axis=1)
    # From s at the start of a step towards u, the mean over it is u + (s - u) (1 - decay) / ratio.
    return u + (before - u) * (-math.expm1(-ratio) / ratio)


def lagged_step(u, time_constant, m, j, h, k, past):
    """Return the same, substep by substep; m[j] is where the lag stands."""
    if k == 0:
        m[j] = past
    if time_constant <= 1e-3 * h:
        m[j] = u
        return u
    ratio = h / time_constant
    before = m[j]
    m[j] = u + (before - u) * math.exp(-ratio)
    return u + (before - u) * (-math.expm1(-ratio) / ratio)


class _ActuatorLag(InputEffect):
    """T du'/dt = u - u'."""

    name: ClassVar[str] = "actuator_lag"
    title: ClassVar[str] = "actuator lag"
    explanation: ClassVar[str] = (
        "The actuator follows its command like a first-order filter: the inductance of a winding, the filling of a "
        "pipe, the inner loop of a drive."
    )
    reference: ClassVar[str] = "Isermann, Mechatronic Systems, 2005, ch. 5"
    on_goal: ClassVar[bool] = True
    place_in_chain: ClassVar[int] = 70
    helpers: ClassVar[tuple[Callable[..., float], ...]] = (lagged_step,)
    linear: ClassVar[bool] = True
    adds_pole: ClassVar[bool] = True
    of_one_mass: ClassVar[bool] = True
    shows_in: ClassVar[tuple[ViewName, ...]] = ("time since reversal", "frequency band")
    confounders: ClassVar[dict[str, str]] = {
        "input_delay": (
            "apply a step and sample fast: with a delay nothing happens at first, with a lag the reading starts to "
            "change at once; an input that switches at short, irregular intervals excites the high frequencies at "
            "which the two differ"
        ),
        "sensor_lag": (
            "measure what the actuator puts out, or add a second sensor: in an otherwise linear machine the two lags "
            "are the same transfer function"
        ),
        "backlash": (
            "repeat a slow triangle at half the speed: with a lag the loop of output over input becomes half as wide, "
            "with backlash it stays as it was"
        ),
        "hysteresis": (
            "repeat a slow triangle at half the speed: with a lag the loop of output over input becomes half as wide, "
            "with hysteresis it stays as it was"
        ),
    }
    substeps: ClassVar[int] = 4

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the time constant."""
        return (Parameter("time constant", "s", 0.0, 0.25 * scales.duration),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from one sample to a good part of the record."""
        return [Start((n * scales.dt,)) for n in (0.7, 2.0, 5.0, 12.0) if n * scales.dt < 0.2 * scales.duration]

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether the kind of output says of which order the plant is; elsewhere one pole more is just order."""
        return scales.kind in ("position", "velocity")

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Delay u by a first-order lag of p[0] seconds; it starts settled."""
        return lagged(u, float(p[0]), h, u[:, 0])

    @staticmethod
    def cells(p: np.ndarray, h: float) -> int:
        """Return how many numbers the step keeps."""
        return 1


@final
class ActuatorLagInMotion(InMotion, _ActuatorLag):
    """The same lag in records at whose start the actuator is on its way."""

    @staticmethod
    def term_from(u: np.ndarray, p: np.ndarray, h: float, start: np.ndarray) -> np.ndarray:
        """Return the same where the actuator starts by `start` of the range of u beside its first value."""
        return lagged(u, float(p[0]), h, u[:, 0] + p[1] * start)

    @staticmethod
    def step(u, p, i, m, j, h, k):
        """Return the same, substep by substep."""
        return lagged_step(u, p[i], m, j, h, k, u + p[i + 1] * m[j])


@EFFECTS.register("actuator_lag")
@final
class ActuatorLag(_ActuatorLag):
    """T du'/dt = u - u', in records that start settled."""

    refined: ClassVar[type[Effect] | None] = ActuatorLagInMotion

    def as_refined(self, values: np.ndarray) -> np.ndarray:
        """Return the lag where every record starts settled."""
        return np.append(values, 0.0)

    @staticmethod
    def step(u, p, i, m, j, h, k):
        """Return the same, substep by substep."""
        return lagged_step(u, p[i], m, j, h, k, u)
