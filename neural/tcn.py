"""Model 9 of the paper: temporal convolutional network."""

from __future__ import annotations

from dataclasses import dataclass

from simgap.neural.training.blocks import Block, Headed, Tcn
from simgap.neural.training.network import Network
from simgap.registry import MODELS


@MODELS.register("tcn")
@dataclass
class TCN(Network):
    """Dilated causal residual blocks - FC(ny); model 9 of the paper.

    The paper gives no widths: 16 channels, kernel 3 and four blocks of dilation 1, 2, 4, 8 here, which see 61 samples.
    """

    channels: int = 16
    kernel: int = 3
    blocks: int = 4

    def net(self, inputs: int, outputs: int) -> Block:
        """Build an untrained network with random weights."""
        body = Tcn(inputs, self.channels, self.kernel, self.blocks, self.dropout)
        return Headed(body, self.channels, outputs)
