"""The mean of the training outputs: what any model must beat."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simgap.records import TrainingSet
from simgap.registry import MODELS
from simgap.step_form import StepForm, constant


@MODELS.register("mean")
@dataclass
class Mean:
    """y_hat(t) = mean of y over train and valid, whatever the input does."""

    def fit(self, data: TrainingSet, seed: int) -> None:
        self.level = np.concatenate([e.y for e in data.train + data.valid]).mean(axis=0)  # [ny]
        self.n_params = len(self.level)
        self._train = data.train

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        return np.tile(self.level, (len(u), u.shape[1] - y_init.shape[1], 1))

    def as_chosen(self) -> Mean:
        """Return the mean of the training data alone."""
        chosen = Mean()
        chosen.level = np.concatenate([e.y for e in self._train]).mean(axis=0)
        return chosen

    def step_form(self, nu: int, ny: int) -> StepForm:
        """Write the model as a step, for exports."""
        return constant(self.level, nu)

    def step_start(self, u: Float[np.ndarray, "T nu"], y_init: Float[np.ndarray, "n ny"]) -> Float[np.ndarray, " ns"]:
        """Return the state of that step before sample n."""
        return self.level
