"""The weighted mean of several simulations."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.stacking import cross_validated, stacked
from simgap.metrics import free_runs
from simgap.protocol import as_chosen, earlier_seconds, is_stochastic
from simgap.records import TrainingSet, UnusableInput
from simgap.registry import MODELS


@MODELS.register("ensemble")
@dataclass
class Ensemble:
    """The mean of the simulations of several models; one that is named twice is fitted twice, with other seeds.

    y_hat = sum_i w_i y_hat_i, w_i >= 0, sum_i w_i = 1, by free runs over the validation data before these are estimated
    on. The seeds of one model share its bias: within a model w_i ~ 1 / mse_i (Bates and Granger 1969); the shares of
    the models have the least squared error (Breiman, Stacked regressions, 1996). Errors that models do not share
    cancel: those of physics and of networks, those of two starts of one network. What it errs by on validation data
    is cross-validated. epochs, batches: of the networks among them, shorter than alone, as they are many; 0 for what
    they do alone. Raises UnusableInput.
    """

    quick: ClassVar = {"models": ("arx", "gru"), "epochs": 6, "batches": 20}

    models: Sequence[str] = ("hybrid", *5 * ("lstm",), *5 * ("encoder",))
    epochs: int = 30
    batches: int = 40
    members: list[Any] = field(init=False, repr=False)
    weights: Float[np.ndarray, " M"] = field(init=False, repr=False)
    held_out_error: float = field(init=False, repr=False)

    def fit(self, data: TrainingSet, seed: int) -> None:
        """Fit the members with seeds of their own, and weigh them."""
        if not self.models:
            raise UnusableInput("an ensemble needs at least one model")
        self.members = [MODELS[name](**self._params(name)) for name in self.models]
        for number, member in enumerate(self.members):
            member.fit(data, len(self.members) * seed + number)
        self._chosen = copy.copy(self)
        self._chosen.members = [as_chosen(member) for member in self.members]
        runs = [free_runs(member.simulate, data.held_out, data.n_init) for member in self._chosen.members]
        simulated, measured = np.array([one for one, _ in runs]), runs[0][1]
        self.weights = self._chosen.weights = stacked(self.models, simulated, measured)
        self.held_out_error = cross_validated(self.models, simulated, measured)

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Simulate with each member that has a weight, and take the mean."""
        used = [(w, member) for w, member in zip(self.weights, self.members, strict=True) if w > 0]
        return np.sum([w * member.simulate(u, y_init) for w, member in used], axis=0)

    def as_chosen(self) -> Ensemble:
        """Return the mean of the members as validation data chose them."""
        return self._chosen

    def _params(self, name: str) -> dict[str, int]:
        given = {"epochs": self.epochs, "batches": self.batches}
        return {key: value for key, value in given.items() if value and hasattr(MODELS[name], key)}

    @property
    def stochastic(self) -> bool:
        """Whether a member is; known before the fit."""
        return any(is_stochastic(MODELS[name](**self._params(name))) for name in self.models)

    @property
    def n_params(self) -> int:
        """Those of all members."""
        return sum(int(getattr(member, "n_params", 0) or 0) for member in self.members)

    @property
    def earlier_seconds(self) -> float:
        """Those of the member whose fit was interrupted."""
        return sum(map(earlier_seconds, self.members))

    @property
    def fitted(self) -> dict[str, Any]:
        """The weight of each member, in the order of their fits."""
        return {"weights": self.weights.tolist()}
