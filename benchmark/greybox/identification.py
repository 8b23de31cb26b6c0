"""From training data to a grey box with the effects that they ask for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgap.greybox.fitting import Problem
from simgap.greybox.joint import is_better, on_joint, with_joint
from simgap.greybox.linear import find_baseline
from simgap.greybox.model import FittedPlant
from simgap.greybox.outliers import flag
from simgap.greybox.plant import plants_of
from simgap.greybox.samples import Records, excerpts
from simgap.greybox.selection import Selection, select
from simgap.records import TrainingSet

STILL_FAR = 0.5  # of the readings that were left out: fewer, and they were never bad


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
    selections = [_selected(data, outputs) for outputs in plants_of(data.channels)]
    experiments = data.train + data.valid
    return [Identified(s, FittedPlant.fit(s.trial.estimate, s.baseline, experiments)) for s in selections]


def _selected(data: TrainingSet, outputs: tuple[int, ...]) -> Selection:
    """Select effects of a rigid drive and, where a flexible joint adds to them, of a drive with one; the better one."""
    rigid = _rigid(data, outputs)
    joint = with_joint(rigid.baseline, data.channels, data.n_init)
    if joint is None or not is_better(on_joint(joint, rigid.trial.estimate), joint, rigid):
        return rigid
    flexible = select(joint)
    return flexible if is_better(flexible.trial.estimate, joint, rigid) else rigid


def _rigid(data: TrainingSet, outputs: tuple[int, ...]) -> Selection:
    """Select effects; again with every reading where those that were left out are not far off the chosen model.

    The error of a model that knows no delay is large for one sample after every step, as that of a bad reading.
    """
    whole = data.train, data.valid, data.channels, outputs, data.n_init
    selection = select(find_baseline(*whole))
    baseline, chosen = selection.baseline, selection.trial.estimate
    if baseline.outliers and chosen.plant.terms:
        records = Records.of(excerpts(data.train), outputs)
        errors = Problem(chosen.plant, records, baseline.noise).errors(chosen.theta, chosen.local)
        left_out = records.mask & ~baseline.train.mask
        if np.mean(flag(errors, records.mask).any(axis=2)[left_out]) < STILL_FAR:
            return select(find_baseline(*whole, every_reading=True))
    return selection
