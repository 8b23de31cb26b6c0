"""A grey box that finds its own effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from simgap.baselines.greybox import GreyBox
from simgap.greybox.identification import identify
from simgap.records import TrainingSet
from simgap.registry import MODELS


@MODELS.register("greybox-auto")
@dataclass
class GreyBoxAuto(GreyBox):
    """The grey box with those effects of the catalogue that training and validation data ask for.

    What `simgap diagnose` does, as a model: score test, refits, held-out likelihood, one effect after the other. It
    knows no time but that since the start of each record.
    """

    effects: Sequence[str] = field(default=(), init=False, repr=False)

    def fit(self, data: TrainingSet, seed: int) -> None:
        """Select effects on excerpts of the training data, then fit them to all of it; nothing here is random."""
        data = data.as_runs()  # a simulation is given inputs and first outputs, and not the time
        found = identify(data)
        self.plants = [identified.plant for identified in found]
        self._chosen = tuple(identified.chosen for identified in found)
        self._train = data.train
