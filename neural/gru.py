"""Model 2 of the paper: gated recurrent units."""

from __future__ import annotations

from dataclasses import dataclass

from simgap.neural.training.blocks import Block, Headed, Recurrences
from simgap.neural.training.network import Network
from simgap.neural.training.recurrent import Gru, recurrent
from simgap.registry import MODELS


@MODELS.register("gru")
@dataclass
class GRU(Network):
    """GRU(units) - FC(ny); model 2 of the paper, which gives no width: 32 units here."""

    units: int = 32

    def net(self, inputs: int, outputs: int) -> Block:
        """Build an untrained network with random weights."""
        return Headed(Recurrences([recurrent(Gru, inputs, self.units)]), self.units, outputs)
