"""A load on the plant that grows from the start of each record."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, final

import numpy as np

from simgap.greybox.effects.effect import Effect, Parameter, Start
from simgap.greybox.effects.scales import SignalScales
from simgap.greybox.effects.wandering_load import DriftingLoad, WanderingLoad
from simgap.registry import EFFECTS

LARGEST = 1e3  # times the force of the input, which a plain model that the drift leads astray shows too small


@final
class SteadyLoadDrift(DriftingLoad):
    """f = r t + f0, t since the machine began to run; f0 is zero where the plant has an operating point."""

    contains: ClassVar[Mapping[str, tuple[int, ...]]] = {"constant_load": (1,)}
    instead_of_order: ClassVar[bool] = True
    moves_poles: ClassVar[bool] = True

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the rise of the load, and what it was when the machine began to run."""
        unit, name, most = scales.force_unit, "load at the start", LARGEST * scales.force_rms
        first = Parameter(name, unit, -most, most) if scales.at_zero else Parameter.absent(name)
        most /= scales.duration
        return Parameter("slope", unit + "/s" if unit else "1/s", -most, most), first

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a slow rise; its amplitude, and so its sign, is then estimated."""
        return [Start((0.1 * scales.force_rms / scales.duration, 0.0), amplitude=0)]

    @staticmethod
    def term(x, v, t, h, p, i, m, j):
        """Return r t + f0."""
        return p[i] * t + p[i + 1]


@EFFECTS.register("load_drift")
@final
class LoadDrift(DriftingLoad):
    """f = r sqrt(3) t / T, with another r in every experiment of T s; r is the rms of the load.

    It has as many numbers as a drift of the sensor, from which the records must tell it. A load that comes and goes is
    tried after it.
    """

    own: ClassVar[int] = 1
    per_experiment: ClassVar[bool] = True
    steady: ClassVar[type[Effect] | None] = SteadyLoadDrift
    refined: ClassVar[type[Effect] | None] = WanderingLoad

    @staticmethod
    def shapes(t: np.ndarray, duration: float, common: np.ndarray) -> np.ndarray:
        """Return the line from zero, of rms 1."""
        return math.sqrt(3) * (t / duration)[None]
