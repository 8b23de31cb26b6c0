"""The same training data with other rounding: how far a model that only computes depends on the processor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simgap.records import Experiment, TrainingSet

# Far below what a measurement resolves, far above the last bit: every rounding on the way of a fit falls anew.
SIZE = 1e-12


def in_other_units(training: TrainingSet, seed: int) -> TrainingSet:
    """Multiply each channel by 1 + 1e-12 r, r standard normal from `seed`; seed 0 leaves the data as they are.

    Values that are equal stay equal, and so do their order and their ratios but for the last bit. What a fit makes of
    it differs as it does between two processors (stochastic arithmetic: Vignes 1993).
    """
    if seed == 0:
        return training
    rng = np.random.default_rng(seed)
    first = training.train[0]
    of_u, of_y = (1 + SIZE * rng.standard_normal(values.shape[1]) for values in (first.u, first.y))

    def scaled(experiments: tuple[Experiment, ...]) -> tuple[Experiment, ...]:
        return tuple(replace(x, u=x.u * of_u, y=x.y * of_y) for x in experiments)

    return replace(training, train=scaled(training.train), valid=scaled(training.valid))
