"""A black-box model with what physical effects do as further inputs."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from simgap.baselines.greybox import GreyBox
from simgap.baselines.greybox_auto import GreyBoxAuto
from simgap.protocol import as_chosen, earlier_seconds, is_stochastic
from simgap.records import Channel, Channels, Experiment, TrainingSet
from simgap.registry import MODELS


@MODELS.register("informed")
@dataclass
class Informed:
    """Another model with one input more per effect: what the effect does to the output of a grey-box simulation.

    d_i(t) = y_hat(t; all effects) - y_hat(t; all but effect i), both simulated from the same start; no measured
    output after the start enters. inner: name of the other model; effects: as for `greybox`, None to find them.
    """

    takes_known: ClassVar = True  # what is known of the machine

    inner: str = "arx"
    effects: Sequence[str] | None = None
    grey: GreyBox = field(init=False, repr=False)
    model: Any = field(init=False, repr=False)

    def fit(self, data: TrainingSet, seed: int) -> None:
        """Find or fit the effects, simulate what they do, and fit the other model with that as inputs."""
        self.grey = GreyBoxAuto() if self.effects is None else GreyBox(self.effects)
        self.grey.fit(data, seed)
        self.model = self._beside_effects(data, seed)
        # Were what effects do to validation data estimated on these, the other model would trust it too much.
        self._chosen = copy.copy(self)
        self._chosen.grey = self.grey.as_chosen()
        self._chosen.model = as_chosen(self._chosen._beside_effects(data, seed))

    def _beside_effects(self, data: TrainingSet, seed: int) -> Any:
        """Fit the other model to the data with what the effects do as inputs."""
        n = data.n_init

        def with_effects(x: Experiment) -> Experiment:
            return Experiment(x.name, self._inputs(x.u[None], x.y[None, :n])[0], x.y, x.dt)

        train = tuple(with_effects(x) for x in data.train if len(x) > n)
        added = tuple(Channel(f"effect{i}") for i in range(train[0].u.shape[1] - data.train[0].u.shape[1]))
        channels = Channels(data.channels.inputs + added, data.channels.outputs)
        valid = tuple(with_effects(x) for x in data.valid if len(x) > n)
        model = MODELS[self.inner]()
        model.fit(replace(data, train=train, valid=valid, channels=channels), seed)
        return model

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """The other model, with what the effects do from this start on."""
        return self.model.simulate(self._inputs(u, y_init), y_init)

    def _inputs(self, u: np.ndarray, y_init: np.ndarray) -> Float[np.ndarray, "B T nue"]:
        """The inputs, and after them one column for each effect."""
        columns = [u]
        for plant in self.grey.plants:
            columns.append(plant.contributions(u, y_init[:, :, list(plant.outputs)]))
        return np.concatenate(columns, axis=2)

    def as_chosen(self) -> Informed:
        """Return both models as validation data chose them."""
        return self._chosen

    @property
    def stochastic(self) -> bool:
        """Whether the other model is, which is known before the fit; the grey box is not."""
        return is_stochastic(MODELS[self.inner]())

    @property
    def earlier_seconds(self) -> float:
        """Those of the other model."""
        return earlier_seconds(self.model)

    @property
    def n_params(self) -> int:
        """Those of both models."""
        return self.grey.n_params + int(getattr(self.model, "n_params", 0) or 0)

    @property
    def fitted(self) -> dict[str, Any]:
        """What both models chose."""
        return self.grey.fitted | {self.inner: getattr(self.model, "fitted", {})}
