"""What free runs get wrong on training and validation data: the views of their errors."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from simgap.error_views.views import views
from simgap.error_views.wrong import Wrong
from simgap.records import Dataset, Experiment

# Views of the error are listed when chance gives as much in fewer cases than this.
MORE_THAN_CHANCE = 0.01
VIEW_SAMPLES = 70_000


def wrong(simulate: Callable[[int, Experiment], np.ndarray], dataset: Dataset, seed: int) -> tuple[Wrong, ...]:
    """View the errors of free runs; the test split is not looked at.

    `simulate` gets the number of an experiment among those of training and validation, and the experiment, or its
    beginning where it is long; it returns rows n_init .. T-1 [N, ny].
    """
    experiments, simulated, samples = [], [], 0
    training = dataset.training.without_mere_starts()
    for i, x in enumerate((*training.train, *training.valid)):
        if len(x) > dataset.n_init + 2 and samples < VIEW_SAMPLES:
            experiments.append(x[:VIEW_SAMPLES])
            simulated.append(simulate(i, experiments[-1]))
            samples += len(experiments[-1])
    seen = views(experiments, simulated, dataset.channels, dataset.n_init, seed)
    return tuple(view for view in seen if view.chance < MORE_THAN_CHANCE and view.share > 0.01)
