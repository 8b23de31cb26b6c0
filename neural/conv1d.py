"""Model 4 of the paper: convolution over time with average pooling."""

from __future__ import annotations

from dataclasses import dataclass

from simgap.neural.training.blocks import Block, Headed, Pooled
from simgap.neural.training.network import Network
from simgap.registry import MODELS


@MODELS.register("conv1d")
@dataclass
class Conv1D(Network):
    """[Conv1D(channels, kernel) - ReLU - average of 2] twice - FC(channels) - ReLU - FC(ny); model 4 of the paper.

    The paper gives no widths: 24 channels and 5 samples here.
    """

    channels: int = 24
    kernel: int = 5

    def net(self, inputs: int, outputs: int) -> Block:
        """Build an untrained network with random weights."""
        return Headed(Pooled(inputs, self.channels, self.kernel, self.window), self.channels, outputs)
