"""Model 1 of the paper: simple recurrent layer."""

from __future__ import annotations

from dataclasses import dataclass

from simgap.neural.training.blocks import Block, Headed, Recurrences
from simgap.neural.training.network import Network
from simgap.neural.training.recurrent import Srnn, recurrent
from simgap.registry import MODELS


@MODELS.register("srnn")
@dataclass
class SRNN(Network):
    """SRNN(units) - FC(ny); model 1 of the paper, which gives no width: 32 units here."""

    units: int = 32

    def net(self, inputs: int, outputs: int) -> Block:
        """Build an untrained network with random weights."""
        return Headed(Recurrences([recurrent(Srnn, inputs, self.units)]), self.units, outputs)
