"""From training data to a grey box with the effects that they ask for."""

from __future__ import annotations

from dataclasses import dataclass

from simgap.greybox.linear import find_baseline
from simgap.greybox.model import FittedPlant
from simgap.greybox.plant import plants_of
from simgap.greybox.selection import Selection, select
from simgap.records import TrainingSet


@dataclass(frozen=True, eq=False)
class Identified:
    """What was found about one plant: the selection of its effects, and the plant fitted to all training data."""

    selection: Selection
    plant: FittedPlant

    @property
    def plain(self) -> FittedPlant:
        """The plain linear plant that gains are counted from."""
        baseline = self.selection.baseline
        return FittedPlant.fit(baseline.estimate, baseline, self.plant.experiments)


def identify(data: TrainingSet) -> list[Identified]:
    """Select effects on excerpts of the training data, then fit them to all of it, plant by plant."""
    selections = [
        select(find_baseline(data.train, data.valid, data.channels, outputs, data.n_init))
        for outputs in plants_of(data.channels)
    ]
    experiments = data.train + data.valid
    return [Identified(s, FittedPlant.fit(s.trial.estimate, s.baseline, experiments)) for s in selections]
