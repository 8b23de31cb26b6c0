"""A grey box that finds its own effects, and a network for what they leave."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation import filter_network
from simgap.baselines.estimation.filter_network import FilterNetwork
from simgap.baselines.greybox import GreyBox
from simgap.baselines.greybox_auto import GreyBoxAuto
from simgap.greybox.model import GreyBoxModel
from simgap.greybox.rest import MATTERS, Rest, RestOfOutput, estimated_again, learn, simulated
from simgap.greybox.rest_features import Design, Features
from simgap.records import TrainingSet
from simgap.registry import MODELS

LONG = 20_000  # training samples from which a network with trained filters may be the better one


@MODELS.register("hybrid")
@dataclass
class Hybrid:
    """`greybox-auto`, and a regression of its error on the inputs and on what it simulates.

        y_hat = g + rest(u, g),   g = the grey box on u from y_init; rest sees g, but no measured output

    The rest is the one of `simgap diagnose` (simgap.greybox.rest), left out where cross-validation shows no gain, or,
    on long records, a network of filters and curves, where that predicts held-out records better.
    """

    stochastic: ClassVar[bool] = True
    takes_known: ClassVar = True  # what is known of the machine
    parts: ClassVar = (Design, Features, FilterNetwork, Rest, RestOfOutput)  # records in a saved model

    grey: GreyBox = field(init=False, repr=False)
    rest: Rest = field(init=False, repr=False)

    def fit(self, data: TrainingSet, seed: int) -> None:
        """Find the effects, then learn what they leave of the training errors; `seed` draws features and weights."""
        self.grey = GreyBoxAuto()
        self.grey.fit(data, seed)
        self.rest = learn(self.grey, seed)
        if data.valid and sum(map(len, data.train)) >= LONG:
            self.rest = self._with_networks(len(data.train), seed)

    def _with_networks(self, trained: int, seed: int) -> Rest:
        """Put a network in the place of each output's rest if it predicts more of what was held out."""
        y_hat, outputs = simulated(self.grey), list(self.rest.outputs)
        for plant in self.grey.plants:
            records = plant.records
            held_out = np.arange(len(records.u)) >= trained
            for j, output in enumerate(plant.outputs):
                e = plant.estimate.errors[..., j]
                network = filter_network.train(records.u, y_hat, e, records.mask, held_out, seed)
                if network.share > (rest.share if (rest := outputs[output]) else MATTERS):
                    outputs[output] = network
        return Rest(tuple(outputs))

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Simulate with the grey box from the state found in the n measured samples, and add the learnt rest."""
        y_hat = self.grey.simulate_whole(u, y_init)
        return (y_hat + self.rest.predict(u, y_hat))[:, y_init.shape[1] :]

    def as_chosen(self) -> Hybrid:
        """Return the grey box as estimated on the training data alone, with the networks, which learn from these only.

        Validation data end their training and have a part in how they are scaled.
        """
        alone = Hybrid()
        alone.grey = self.grey.as_chosen()
        alone.rest = estimated_again(self.rest, alone.grey)
        return alone

    def grey_and_rest(self) -> tuple[GreyBoxModel, Rest]:
        """Return the two whose outputs are added, for exports."""
        return self.grey, self.rest

    @property
    def n_params(self) -> int:
        """Those of the grey box, and of the rest those that were estimated."""
        return self.grey.n_params + self.rest.n_params

    @property
    def fitted(self) -> dict[str, Any]:
        """What the grey box chose, and the share of its error that the rest predicts in held-out training data."""
        return self.grey.fitted | {"learnt": [rest.share if rest else 0.0 for rest in self.rest.outputs]}
