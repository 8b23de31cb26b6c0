"""Model 1 of the paper: simple recurrent layer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from simgap.neural.training.blocks import Block, Headed, Recurrences
from simgap.neural.training.network import STATEFUL, Network
from simgap.neural.training.recurrent import Srnn, recurrent
from simgap.registry import MODELS


@MODELS.register("srnn")
@dataclass
class SRNN(Network):
    """SRNN(units) - FC(ny); model 1 of the paper, which gives no width: 32 units here.

    Stateful, it takes smaller steps than the others, and more of them. On the validation part of Wiener-Hammerstein a
    rate of 1e-3 ends at half the error of 3e-3, but needs more than 300 epochs.
    """

    stateful: ClassVar = replace(STATEFUL, epochs=1200, learning_rate=1e-3)

    units: int = 32

    def net(self, inputs: int, outputs: int) -> Block:
        """Build an untrained network with random weights."""
        return Headed(Recurrences([recurrent(Srnn, inputs, self.units)]), self.units, outputs)
