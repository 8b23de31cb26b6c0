"""From training data to a grey box with the effects that they ask for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from simgap.greybox.kind_of_output import Settled, settle
from simgap.greybox.linear import find_baseline
from simgap.greybox.model import FittedPlant
from simgap.greybox.plant import plants_of
from simgap.greybox.position_and_velocity import with_kind, with_velocity
from simgap.greybox.selection import Selection, select
from simgap.records import Channels, TrainingSet


@dataclass(frozen=True, eq=False)
class Identified:
    """What was found about one plant: the selection of its effects, and the plant fitted to all training data."""

    selection: Selection
    plant: FittedPlant
    settled: Settled | None = None  # what its output is, where nobody had said it

    @property
    def plain(self) -> FittedPlant:
        """The plain linear plant that gains are counted from."""
        baseline = self.selection.baseline
        return FittedPlant.fit(baseline.estimate, baseline, self.plant.experiments)


def identify(data: TrainingSet) -> list[Identified]:
    """Select effects on excerpts of the training data, then fit them to all of it, plant by plant."""
    channels, experiments = with_velocity(data), data.train + data.valid
    identified = []
    for outputs in plants_of(channels):
        if channels.outputs[outputs[0]].kind_from == "unknown":
            settled = settle(data, channels, outputs[0])
            selection = select(settled.baseline, settled.compared)
        else:
            settled = None
            selection = select(find_baseline(data.train, data.valid, channels, outputs, data.n_init))
        plant = FittedPlant.fit(selection.trial.estimate, selection.baseline, experiments)
        identified.append(Identified(selection, plant, settled))
    return identified


def channels_of(identified: Sequence[Identified], data: TrainingSet) -> Channels:
    """Return the channels with what the identification found out about them."""
    channels = with_velocity(data)
    for one in identified:
        if one.settled is not None:
            channels = with_kind(channels, one.selection.baseline.outputs[0], one.settled.kind)
    return channels
