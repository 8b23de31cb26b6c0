"""Plain grey boxes for tests that need a model of a rig, but no effects."""

from simgap.greybox.linear import find_baseline
from simgap.greybox.model import FittedPlant, GreyBoxModel
from simgap.greybox.position_and_velocity import plants_of
from simgap.records import TrainingSet


def plain_grey_box(data: TrainingSet) -> GreyBoxModel:
    """The plain linear model of each plant, fitted to all training data."""
    plants = []
    for outputs in plants_of(data, data.channels):
        baseline = find_baseline(data.train, data.valid, data.channels, outputs, data.n_init)
        plants.append(FittedPlant.fit(baseline.estimate, baseline, data.train + data.valid))
    return GreyBoxModel(plants)
