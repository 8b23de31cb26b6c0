"""The last measured output, held: hard to beat on slow plants and short horizons."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simgap.records import TrainingSet
from simgap.registry import MODELS


@MODELS.register("hold")
@dataclass
class Hold:
    """y_hat(t) = y(n-1), the last of the n samples that start the simulation."""

    n_params = 0

    def fit(self, data: TrainingSet, seed: int) -> None:
        """Estimate nothing: the model has no parameter."""

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        return np.repeat(y_init[:, -1:], u.shape[1] - y_init.shape[1], axis=1)
