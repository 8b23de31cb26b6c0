"""A first-order lag of the sensor."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar, final

import numpy as np
from scipy.signal import lfilter

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import Effect, OutputEffect, Parameter, Start
from simgap.greybox.effects.in_motion import InMotion
from simgap.greybox.effects.scales import SignalScales
from simgap.registry import EFFECTS


def read_late(y: np.ndarray, time_constant: float, dt: float, away: np.ndarray) -> np.ndarray:
    """Return y [E, T] behind a first-order lag, exact for straight lines between samples; it starts `away` from y."""
    if time_constant <= 1e-3 * dt:
        return y
    ratio = dt / time_constant
    decay = np.exp(-ratio)
    now = 1 - (1 - decay) / ratio  # weight of the new sample; the old one has the rest
    begun = (1 - now) * y[:, 0] + away
    reading, _ = lfilter([now, 1 - decay - now], [1.0, -decay], y, axis=1, zi=begun[:, None])
    return reading


def read_late_step(y, time_constant, m, j, h, k, away):
    """Return the same, sample by sample."""
    if time_constant <= 1e-3 * h:
        m[j + 1] = y
    elif k == 0:
        m[j + 1] = y + away
    else:
        ratio = h / time_constant
        decay = math.exp(-ratio)
        now = 1 - (1 - decay) / ratio
        m[j + 1] = now * y + (1 - decay - now) * m[j] + decay * m[j + 1]
    m[j] = y
    return m[j + 1]


def _step(t: np.ndarray) -> float:
    return float(t[1] - t[0]) if len(t) > 1 else math.inf  # of a single sample nothing is late


class _SensorLag(OutputEffect):
    """T dr/dt = y - r, r the reading."""

    name: ClassVar[str] = "sensor_lag"
    title: ClassVar[str] = "sensor lag"
    explanation: ClassVar[str] = (
        "The reading follows the quantity like a first-order filter: a thermometer in its sheath, a filtered signal."
    )
    reference: ClassVar[str] = "Isermann, Mechatronic Systems, 2005, ch. 8"
    place_in_chain: ClassVar[int] = 110
    helpers: ClassVar[tuple[Callable[..., float], ...]] = (read_late_step,)
    linear: ClassVar[bool] = True
    adds_pole: ClassVar[bool] = True
    of_one_mass: ClassVar[bool] = True
    shows_in: ClassVar[tuple[ViewName, ...]] = ("time since reversal", "frequency band")

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
    def term(y: np.ndarray, p: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Delay y by a first-order lag of p[0] seconds; it starts settled."""
        return read_late(y, float(p[0]), _step(t), np.zeros(len(y)))

    @staticmethod
    def cells(p: np.ndarray, h: float) -> int:
        """Return how many numbers the step keeps."""
        return 2


@final
class SensorLagInMotion(InMotion, _SensorLag):
    """The same lag in records at whose start the reading is on its way."""

    @staticmethod
    def term_from(y: np.ndarray, p: np.ndarray, t: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Return the same where the reading starts by `start` of its range beside y."""
        return read_late(y, float(p[0]), _step(t), p[1] * start)

    @staticmethod
    def step(y, p, i, m, j, h, k):
        """Return the same, sample by sample."""
        return read_late_step(y, p[i], m, j, h, k, p[i + 1] * m[j])


@EFFECTS.register("sensor_lag")
@final
class SensorLag(_SensorLag):
    """T dr/dt = y - r, r the reading, in records that start settled."""

    refined: ClassVar[type[Effect] | None] = SensorLagInMotion

    def as_refined(self, values: np.ndarray) -> np.ndarray:
        """Return the lag where every record starts settled."""
        return np.append(values, 0.0)

    @staticmethod
    def step(y, p, i, m, j, h, k):
        """Return the same, sample by sample."""
        return read_late_step(y, p[i], m, j, h, k, 0.0)
