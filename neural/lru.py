"""Linear recurrent units: Orvieto et al., Resurrecting Recurrent Neural Networks for Long Sequences, ICML 2023."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from simgap.neural.training.blocks import Block, Headed
from simgap.neural.training.linear_blocks import Entry, Lru, Stacked
from simgap.neural.training.network import STATEFUL, Network
from simgap.registry import MODELS

RADII, ANGLE = (0.4, 0.99), 1.0  # of the poles at first: a few samples to a few hundred, up to a sixth of the rate


@MODELS.register("lru")
@dataclass
class LRU(Network):
    """FC(units) - layers x [x + GLU(LRU(x)), `states` complex states each] - FC(ny).

    Stateful, it has a recipe of its own, chosen, like its sizes, on the validation part of Wiener-Hammerstein: 6.6 mV
    with 30 epochs at 3e-3 and three layers of 32, 1.3 with this.
    """

    stateful: ClassVar = replace(STATEFUL, epochs=100, learning_rate=1e-2, patience=5, early_stop=30)

    units: int = 24
    states: int = 24
    layers: int = 2

    def net(self, inputs: int, outputs: int) -> Block:
        """Build an untrained network with random weights."""
        layers = [Lru(self.units, self.states, RADII, ANGLE, self.dropout) for _ in range(self.layers)]
        return Headed(Stacked([Entry(inputs, self.units), *layers]), self.units, outputs)
