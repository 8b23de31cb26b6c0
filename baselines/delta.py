"""Any other model, trained on differences."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.protocol import as_chosen, earlier_seconds, is_stochastic
from simgap.records import Experiment, TrainingSet, UnusableInput
from simgap.registry import MODELS


@MODELS.register("delta")
@dataclass
class Delta:
    """Another model of the differences y(k) - y(k-1), whose simulation is summed up from the last measured sample.

    y_hat(k) = y(n-1) + sum over n <= i <= k of d_hat(i) (the paper's "delta" set, section 3.8). An error of the mean
    of d_hat becomes a drift. model: name of the other one; params: its hyper-parameters. Raises UnusableInput.
    """

    model: str = "arx"
    params: dict[str, Any] = field(default_factory=dict)
    inner: Any = field(init=False, repr=False)

    def fit(self, data: TrainingSet, seed: int) -> None:
        """Fit the other model to the differences."""
        if data.n_init < 2:
            raise UnusableInput("delta needs at least two measured samples to start, for one difference")
        self.inner = MODELS[self.model](**self.params)
        train, valid = (tuple(_differences(x) for x in part if len(x) > 1) for part in (data.train, data.valid))
        self.inner.fit(replace(data, train=train, valid=valid, n_init=data.n_init - 1), seed)

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Sum up the simulated differences from the last of the n measured samples.

        Before a single sample the plant is taken to have stood still.
        """
        if y_init.shape[1] == 1:
            differences = self.inner.simulate(u, np.zeros_like(y_init))
        else:
            differences = self.inner.simulate(u[:, 1:], np.diff(y_init, axis=1))
        return y_init[:, -1:] + np.cumsum(differences, axis=1)

    def as_chosen(self) -> Delta:
        """Sum up the differences of the other model as validation data chose it."""
        chosen = Delta(self.model, self.params)
        chosen.inner = as_chosen(self.inner)
        return chosen

    @property
    def stochastic(self) -> bool:
        """Whether the other model is; known before the fit."""
        return is_stochastic(MODELS[self.model](**self.params))

    @property
    def earlier_seconds(self) -> float:
        """Those of the model within."""
        return earlier_seconds(self.inner)

    @property
    def n_params(self) -> int | None:
        """Number of parameters of the inner model."""
        return getattr(self.inner, "n_params", None)

    @property
    def fitted(self) -> dict[str, Any]:
        """What the inner model chose for itself."""
        return getattr(self.inner, "fitted", {})


def _differences(x: Experiment) -> Experiment:
    return Experiment(x.name, x.u[1:], np.diff(x.y, axis=0), x.dt)
