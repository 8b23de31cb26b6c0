"""A dead time of the input."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import Effect, InputEffect, Parameter, Start
from simgap.greybox.effects.in_motion import InMotion
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


def late(u: np.ndarray, delay: float, h: float, past: np.ndarray) -> np.ndarray:
    """Return the mean over each step of h seconds of u [E, K], so many seconds before; `past` [E] stood before it."""
    whole, part = divmod(max(delay, 0.0) / h, 1.0)
    steps = min(int(whole), u.shape[1] - 1)
    padded = np.concatenate((np.repeat(past[:, None], steps + 1, axis=1), u), axis=1)
    return (1 - part) * padded[:, 1 : 1 + u.shape[1]] + part * padded[:, : u.shape[1]]


def late_step(u, delay, m, j, h, k, past):
    """Return the same, substep by substep."""
    steps = int(max(delay, 0.0) / h)
    size = steps + 2  # of the ring of past values
    if k == 0:
        for at in range(size):
            m[j + at] = past
    m[j + k % size] = u
    part = max(delay, 0.0) / h - steps
    return (1 - part) * m[j + (k + 2) % size] + part * m[j + (k + 1) % size]


class _Delay(InputEffect):
    """u'(t) = u(t - tau)."""

    name: ClassVar[str] = "input_delay"
    title: ClassVar[str] = "input delay"
    explanation: ClassVar[str] = (
        "The input arrives unchanged but late: transport in a pipe or on a belt, a bus, a computation that takes one "
        "cycle."
    )
    reference: ClassVar[str] = "Ljung, System Identification, 1999, sec. 4.2 and 10.3"
    on_goal: ClassVar[bool] = True
    place_in_chain: ClassVar[int] = 10
    helpers: ClassVar[tuple[Callable[..., float], ...]] = (late_step,)
    linear: ClassVar[bool] = True
    instead_of_order: ClassVar[bool] = True
    shows_in: ClassVar[tuple[ViewName, ...]] = ("time since reversal", "frequency band")
    confounders: ClassVar[dict[str, str]] = {
        "sensor_lag": (
            "apply a step and sample fast: with a delay nothing happens at first, with a lag the reading starts to "
            "change at once"
        ),
    }
    substeps: ClassVar[int] = 4

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the delay."""
        return (Parameter("delay", "s", 0.0, min(60 * scales.dt, 0.25 * scales.duration)),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from half a sample to many."""
        return [Start((n * scales.dt,)) for n in (0.5, 1.5, 3.0, 6.0, 12.0) if n * scales.dt < 0.2 * scales.duration]

    @staticmethod
    def term(u: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """Return the mean over each step of u, p[0] seconds before; before the record u stood at its first value."""
        return late(u, p[0], h, u[:, 0])

    @staticmethod
    def cells(p: np.ndarray, h: float) -> int:
        """Return how many numbers the step keeps."""
        return int(max(p[0], 0.0) / h) + 2


@final
class DelayInMotion(InMotion, _Delay):
    """The same delay in records before which u stood elsewhere."""

    @staticmethod
    def term_from(u: np.ndarray, p: np.ndarray, h: float, start: np.ndarray) -> np.ndarray:
        """Return the same where u stood by `start` of its range beside its first value."""
        return late(u, p[0], h, u[:, 0] + p[1] * start)

    @staticmethod
    def step(u, p, i, m, j, h, k):
        """Return the same, substep by substep."""
        return late_step(u, p[i], m, j, h, k, u + p[i + 1] * m[j])


@EFFECTS.register("input_delay")
@final
class InputDelay(_Delay):
    """u'(t) = u(t - tau), in records before which u stood at its first value."""

    refined: ClassVar[type[Effect] | None] = DelayInMotion

    def as_refined(self, values: np.ndarray) -> np.ndarray:
        """Return the delay where nothing stood elsewhere."""
        return np.append(values, 0.0)

    @staticmethod
    def step(u, p, i, m, j, h, k):
        """Return the same, substep by substep."""
        return late_step(u, p[i], m, j, h, k, u)
