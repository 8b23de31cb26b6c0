"""Intervals of the parameters of a fitted plant."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from simgap.greybox.model import FittedPlant


def intervals(fitted: FittedPlant) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """Compute the 95 % intervals of theta, within its bounds; the bounds where no slope is finite."""
    plant, theta, known = fitted.estimate.plant, fitted.estimate.theta, fitted.uncertainty
    if known is None:
        return plant.low, plant.high
    reach = known.reach()
    return np.maximum(theta - reach, plant.low), np.minimum(theta + reach, plant.high)
