"""A linear plant with chosen physical effects, fitted to the simulation error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.greybox.model import Machine, groups
from simgap.greybox.plant import Term
from simgap.greybox.selection import Search
from simgap.records import Experiment, TrainingSet, UnusableInput
from simgap.registry import EFFECTS, MODELS


@MODELS.register("greybox")
@dataclass
class GreyBox:
    """x' = A x + B (u' + f), y = C x: low order, with effects of the catalogue on input, force or output.

    Order 1 for a velocity, 2 for a position, else what held-out data ask for up to 4; fitted by simulation error
    (Ljung 1999, section 4.2) from several starts, with the start state of every experiment estimated along.
    effects: names of `simgap list effects`, "name:channel" where an effect can sit on several channels.
    """

    effects: Sequence[str] = ()
    machines: list[Machine] = field(default_factory=list, init=False, repr=False)

    def fit(self, data: TrainingSet, seed: int) -> None:
        """Fit the plain model, then add the effects one by one in the given order; nothing here is random."""
        self.machines = []
        placed = [_place(name, data) for name in self.effects]
        for outputs in groups(data.channels):
            search = Search.of(data.train, data.valid, data.channels, outputs)
            found = search.plain
            for effect, plant, channel in placed:
                if effect.name == "outliers":
                    continue  # left out by the search itself
                if plant is None or plant == outputs:
                    found = search.add(found, Term(effect, channel))
            self.machines.append(Machine.fit(found, search, data.train + data.valid))

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """The state is found from the n measured samples; what belongs to single experiments is not forecast."""
        y_hat = np.empty((len(u), u.shape[1] - y_init.shape[1], y_init.shape[2]))
        for machine in self.machines:
            outputs = list(machine.outputs)
            y_hat[:, :, outputs] = machine.simulate(u, y_init[:, :, outputs])
        return y_hat

    def simulate_anew(self, experiment: Experiment, n_init: int) -> Float[np.ndarray, "N ny"]:
        """A free run of one experiment, with the parameters that belong to it alone estimated from it."""
        y_hat = np.empty((len(experiment) - n_init, experiment.y.shape[1]))
        for machine in self.machines:
            y_hat[:, list(machine.outputs)] = machine.again(experiment, n_init)
        return y_hat

    def log_likelihood(self) -> float:
        """Of the training errors, as white noise on each output, up to a constant."""
        return sum(machine.log_likelihood() for machine in self.machines)

    @property
    def n_params(self) -> int:
        """Numbers that a simulation uses."""
        return sum(int(machine.forecasting.free.sum()) for machine in self.machines)

    @property
    def fitted(self) -> dict[str, Any]:
        """Order of each plant and its effects."""
        return {
            "order": [machine.estimate.structure.order for machine in self.machines],
            "effects": [[term.effect.name for term in m.estimate.structure.terms] for m in self.machines],
        }


def _place(name: str, data: TrainingSet) -> tuple[Any, tuple[int, ...] | None, int]:
    """The effect, the plant it belongs to (None: any), and its channel there. Raises UnusableInput."""
    name, _, channel = name.partition(":")
    effect = EFFECTS[name]()
    inputs, outputs = data.channels.inputs, data.channels.outputs
    if not channel:
        return effect, None if effect.port == "input" else groups(data.channels)[0], 0
    names = [c.name for c in (inputs if effect.port == "input" else outputs)]
    if channel not in names:
        raise UnusableInput(f"{name}:{channel}: there is no such {effect.port}; known are {', '.join(names)}")
    at = names.index(channel)
    if effect.port == "input":
        return effect, None, at
    plant = next(group for group in groups(data.channels) if at in group)
    return effect, plant, plant.index(at) if effect.port == "output" else 0
