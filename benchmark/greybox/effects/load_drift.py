"""A load on the plant that grows from the start of each record."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np

from simgap.error_views.wrong import ViewName
from simgap.greybox.effects.effect import Effect, ForceEffect, Parameter, SignalScales, Start
from simgap.greybox.effects.wandering_load import WanderingLoad
from simgap.registry import EFFECTS


@EFFECTS.register("load_drift")
@final
class LoadDrift(ForceEffect):
    """f = r sqrt(3) t / T, with another r in every experiment of T s; r is the rms of the load.

    It has as many numbers as a drift of the sensor, from which the records must tell it. A load that comes and goes is
    tried after it.
    """

    name: ClassVar[str] = WanderingLoad.name
    title: ClassVar[str] = WanderingLoad.title
    explanation: ClassVar[str] = WanderingLoad.explanation
    reference: ClassVar[str] = WanderingLoad.reference
    own: ClassVar[int] = 1
    substeps: ClassVar[int] = 1
    per_experiment: ClassVar[bool] = True
    refined: ClassVar[type[Effect] | None] = WanderingLoad
    shows_in: ClassVar[tuple[ViewName, ...]] = WanderingLoad.shows_in
    confounders: ClassVar[dict[str, str]] = WanderingLoad.confounders

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return the size of the load."""
        return WanderingLoad().parameters(scales)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from a small load; its size in each experiment is then estimated."""
        return WanderingLoad().starts(scales)

    def applies_to(self, scales: SignalScales) -> bool:
        """Tell whether there are dynamics that a load acts through; else it is the reading that drifts."""
        return scales.order > 0

    @staticmethod
    def shapes(t: np.ndarray, duration: float) -> np.ndarray:
        """Return the line from zero, of rms 1."""
        return math.sqrt(3) * (t / duration)[None]
