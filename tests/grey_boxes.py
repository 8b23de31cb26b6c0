"""Plain grey boxes for tests that need a model of a rig, but no effects."""

from simgap.greybox.linear import find_baseline
from simgap.greybox.model import FittedPlant, GreyBoxModel
from simgap.greybox.plant import plants_of
from simgap.records import Dataset


def plain_grey_box(dataset: Dataset) -> GreyBoxModel:
    """The plain linear model of each plant, fitted to all training data."""
    training, channels = dataset.training, dataset.channels
    plants = []
    for outputs in plants_of(channels):
        baseline = find_baseline(training.train, training.valid, channels, outputs, dataset.n_init)
        plants.append(FittedPlant.fit(baseline.estimate, baseline, training.train + training.valid))
    return GreyBoxModel(plants)
