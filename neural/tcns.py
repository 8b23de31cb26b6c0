"""Models 10a and 10b of the paper: two temporal convolutional networks side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from simgap.neural.training.blocks import Block, Headed, Parallel, Tcn
from simgap.neural.training.network import Network
from simgap.registry import MODELS


@MODELS.register("tcns")
@dataclass
class TCNs(Network):
    """[TCN | TCN] - FC - ReLU - FC with a skip connection around both - FC(ny).

    Model 10a of the paper is this with L2 (l2=0.001), 10b with dropout (dropout=0.1); it gives neither these numbers
    nor widths: 12 channels, kernels 3 and 5, four and three blocks, 32 between the fully connected layers here.
    """

    channels: int = 12
    kernels: Sequence[int] = (3, 5)
    blocks: Sequence[int] = (4, 3)
    hidden: int = 32

    def net(self, inputs: int, outputs: int) -> Block:
        """Build an untrained network with random weights."""
        branches = [
            Tcn(inputs, self.channels, kernel, blocks, self.dropout)
            for kernel, blocks in zip(self.kernels, self.blocks, strict=True)
        ]
        return Headed(Parallel(branches, 2 * self.channels, self.hidden), 2 * self.channels, outputs)
