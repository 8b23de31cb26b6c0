"""Model 7 of the paper: LSTMs of growing width."""

from __future__ import annotations

from dataclasses import dataclass

from simgap.neural.training.blocks import Block, Headed, Recurrences
from simgap.neural.training.network import Network
from simgap.neural.training.recurrent import Lstm, recurrent
from simgap.registry import MODELS


@MODELS.register("decoder")
@dataclass
class Decoder(Network):
    """LSTM(first) - LSTM(second) - FC(ny); model 7 of the paper, which gives no widths: 8 and 16 here."""

    first: int = 8
    second: int = 16

    def net(self, inputs: int, outputs: int) -> Block:
        """Build an untrained network with random weights."""
        layers = (recurrent(Lstm, inputs, self.first), recurrent(Lstm, self.first, self.second))
        return Headed(Recurrences(layers), self.second, outputs)
