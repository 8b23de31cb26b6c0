"""From training data to a grey box with the effects that they ask for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simgap.greybox.baseline import Baseline
from simgap.greybox.fitting import Estimate
from simgap.greybox.inner_filter import with_inner_filter
from simgap.greybox.kind_of_output import Settled, settle
from simgap.greybox.linear import find_baseline
from simgap.greybox.linear_rival import LinearRival, linear_rival
from simgap.greybox.machine_baseline import find_machine_baseline
from simgap.greybox.model import FittedPlant
from simgap.greybox.outliers import flag
from simgap.greybox.position_and_velocity import plants_of, with_kind, with_velocity
from simgap.greybox.problem import Problem
from simgap.greybox.rivals import of_better_joint, of_better_order, of_several_masses
from simgap.greybox.samples import Records, excerpts
from simgap.greybox.selection import Selection, select
from simgap.records import Channels, TrainingSet
from simgap.stages import stage

STILL_FAR = 0.5  # of the readings that were left out: fewer, and they were never bad


@dataclass(frozen=True, eq=False)
class Identified:
    """What was found about one plant: the selection of its effects, and the plant fitted to all training data.

    Where the effects do no better than a linear model of another order, the plant is that one.
    """

    selection: Selection
    plant: FittedPlant
    settled: Settled | None = None  # what its output is, where nobody had said it
    linear: LinearRival | None = None  # the linear model that does as well

    @property
    def chosen(self) -> tuple[Estimate, Baseline]:
        """What was found on excerpts of the training data, and the plain model that it was built on."""
        return _chosen(self.selection, self.linear)

    @cached_property
    def plain(self) -> FittedPlant:
        """The plain linear plant that gains are counted from."""
        baseline = self.selection.baseline
        return FittedPlant.fit(baseline.estimate, baseline, self.plant.experiments)


def identify(data: TrainingSet, effects: bool = True) -> list[Identified]:
    """Select effects (or none) on excerpts of the training data, then fit the model to all of it, plant by plant."""
    data = data.without_mere_starts()
    channels, experiments = with_velocity(data), data.train + data.valid
    identified = []
    for outputs in plants_of(data, channels):
        output = outputs[0]
        stage(f"Fitting the plain linear model of {channels.outputs[output].name}")
        unsaid = effects and channels.outputs[output].kind_from == "unknown"
        settled = settle(data, channels, output) if unsaid else None
        of_kind = with_kind(channels, output, settled.kind) if settled else channels
        selection = _selected(data, of_kind, outputs, settled) if effects else _plain(data, of_kind, outputs)
        linear = None
        if effects and channels.plant is None:
            stage("Comparing with linear models of other orders")
            selection = of_better_joint(of_better_order(selection, of_kind), of_kind)
            selection = with_inner_filter(selection, of_kind)
            linear = linear_rival(of_kind, selection)
            if linear is not None and (swinging := of_several_masses(linear.baseline, selection, of_kind)):
                selection, linear = swinging, None
        plant = FittedPlant.fit(*_chosen(selection, linear), experiments)
        identified.append(Identified(selection, plant, settled, linear))
    return identified


def _chosen(selection: Selection, linear: LinearRival | None) -> tuple[Estimate, Baseline]:
    if linear is not None:
        return linear.baseline.estimate, linear.baseline
    return selection.trial.estimate, selection.baseline


def channels_of(identified: Sequence[Identified], data: TrainingSet) -> Channels:
    """Return the channels with what the identification found out about them."""
    channels = with_velocity(data)
    for one in identified:
        if one.settled is not None:
            channels = with_kind(channels, one.selection.baseline.outputs[0], one.settled.kind)
    return channels


def _selected(data: TrainingSet, channels: Channels, outputs: tuple[int, ...], settled: Settled | None) -> Selection:
    """Select effects; again with every reading where those that were left out are not far off the chosen model.

    The error of a model that knows no delay is large for one sample after every step, as that of a bad reading.
    """
    whole = data.train, data.valid, channels, outputs, data.n_init
    if channels.plant is not None:
        return select(find_machine_baseline(*whole))
    selection = select(settled.baseline, settled.extended) if settled else select(find_baseline(*whole))
    baseline, chosen = selection.baseline, selection.trial.estimate
    if baseline.outliers and chosen.plant.terms:
        records = Records.of(excerpts(data.train), outputs)
        errors = Problem(chosen.plant, records, baseline.noise).errors(chosen.theta, chosen.local)
        left_out = records.mask & ~baseline.train.mask
        if np.mean(np.any(flag(errors, records.mask), axis=2)[left_out]) < STILL_FAR:
            return select(find_baseline(*whole, every_reading=True))
    return selection


def _plain(data: TrainingSet, channels: Channels, outputs: tuple[int, ...]) -> Selection:
    """Take the plain model for the answer."""
    find = find_baseline if channels.plant is None else find_machine_baseline
    return Selection.of_none(find(data.train, data.valid, channels, outputs, data.n_init))
