"""A load on the plant that comes and goes slowly."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from numpy.polynomial.legendre import legvander

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import ForceEffect, Parameter, Start
from simgap.greybox.effects.scales import SignalScales


class DriftingLoad(ForceEffect):
    """A load that changes slowly, whatever its law."""

    name: ClassVar[str] = "load_drift"
    title: ClassVar[str] = "a drifting load"
    explanation: ClassVar[str] = (
        "A force, a flow or a heat from outside comes and goes slowly: a leak that opens, the room that cools down, "
        "a cable that winds up, a bearing that warms."
    )
    reference: ClassVar[str] = "Ljung, System Identification, 1999, section 14.1"
    substeps: ClassVar[int] = 1
    shows_in: ClassVar[tuple[ViewName, ...]] = ("drift within experiment", "time since the start")
    confounders: ClassVar[dict[str, str]] = {
        "sensor_drift": (
            "hold the machine still, or read it with a second sensor: the reading of a drifting sensor still moves, "
            "while a load that drifts has moved the machine itself"
        ),
        "constant_load": "record for longer: a load that drifts goes on changing, a constant one does not",
        "gain_fade": "record without any input: a load that drifts is still there, a fading gain has nothing to act on",
        "periodic_disturbance": "record for longer: a disturbance repeats itself, a load that drifts does not",
    }

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the size of the load."""
        return (Parameter("load", scales.force_unit, -20 * scales.force_rms, 20 * scales.force_rms),)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a small load; its course is then estimated."""
        return [Start((0.1 * scales.force_rms,), amplitude=0)]

    @staticmethod
    def size(own: np.ndarray, added: np.ndarray, measured: np.ndarray) -> np.ndarray:
        """Return the rms of the load over each record."""
        return np.sqrt(np.sum(added**2 * measured, axis=1) / np.maximum(measured.sum(axis=1), 1))

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether there are dynamics that a load acts through; else it is the reading that drifts."""
        return scales.order > 0


@final
class WanderingLoad(DriftingLoad):
    """f = sum over k of r_k sqrt(2 k + 1) P_k(2 t / T - 1), P_k of Legendre, with other r in every experiment of T s.

    The norm of r is the rms of the load.
    """

    own: ClassVar[int] = 5
    per_experiment: ClassVar[bool] = True

    @staticmethod
    def shapes(t: np.ndarray, duration: float, common: np.ndarray) -> np.ndarray:
        """Return Legendre's polynomials, each of rms 1."""
        powers = np.arange(WanderingLoad.own)
        return np.sqrt(2 * powers + 1)[:, None] * legvander(2 * t / duration - 1, WanderingLoad.own - 1).T
