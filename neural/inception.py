"""Model 5 of the paper: three kinds of layers side by side."""

from __future__ import annotations

from dataclasses import dataclass

from simgap.neural.training.blocks import Block, Headed, Parallel, Pooled, Recurrences
from simgap.neural.training.network import Network
from simgap.neural.training.recurrent import Gru, Lstm, recurrent
from simgap.registry import MODELS


@MODELS.register("inception")
@dataclass
class Inception(Network):
    """[GRU | LSTM | Conv1D] - FC - ReLU - FC with a skip connection around both - FC(ny); model 5 of the paper.

    The paper gives no widths: 16 features from each branch and 32 between the fully connected layers here.
    `last_dropout` acts before the last layer, where the paper advises against it (4.2).
    """

    units: int = 16
    kernel: int = 5
    hidden: int = 32
    last_dropout: float = 0.0

    def net(self, inputs: int, outputs: int) -> Block:
        """Build an untrained network with random weights."""
        branches = (
            Recurrences([recurrent(Gru, inputs, self.units)]),
            Recurrences([recurrent(Lstm, inputs, self.units)]),
            Pooled(inputs, self.units, self.kernel, self.window),
        )
        joined = Parallel(branches, 3 * self.units, self.hidden, self.dropout, self.last_dropout)
        return Headed(joined, 3 * self.units, outputs)
