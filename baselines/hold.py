"""The last measured output, held: hard to beat on slow plants and short horizons."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simgap.records import TrainingSet
from simgap.registry import MODELS
from simgap.step_form import StepForm, constant


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

    def step_form(self, nu: int, ny: int) -> StepForm:
        """Write the model as a step, for exports; at rest, it stands at zero."""
        return constant(np.zeros(ny), nu)

    def step_start(self, u: Float[np.ndarray, "T nu"], y_init: Float[np.ndarray, "n ny"]) -> Float[np.ndarray, " ns"]:
        """Return the state of that step before sample n."""
        return y_init[-1]
