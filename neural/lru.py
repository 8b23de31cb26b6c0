"""Linear recurrent units: Orvieto et al., Resurrecting Recurrent Neural Networks for Long Sequences, ICML 2023."""

from __future__ import annotations

from dataclasses import dataclass

from simgap.neural.training.blocks import Block, Headed
from simgap.neural.training.linear_blocks import Lru, Mixed, Stacked
from simgap.neural.training.network import Network
from simgap.registry import MODELS


@MODELS.register("lru")
@dataclass
class LRU(Network):
    """FC(units) - layers x [x + GLU(LRU(x)), `states` complex states each] - FC(ny)."""

    units: int = 32
    states: int = 32
    layers: int = 3

    def net(self, inputs: int, outputs: int) -> Block:
        """Build an untrained network with random weights."""
        layers = [Lru(self.units, self.states, (0.4, 0.99), 1.0, self.dropout) for _ in range(self.layers)]
        return Headed(Stacked([Mixed(inputs, self.units), *layers]), self.units, outputs)
