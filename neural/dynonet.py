"""dynoNet: Forgione and Piga, Int. J. Adaptive Control and Signal Processing 35(4), 2021."""

from __future__ import annotations

from dataclasses import dataclass

from simgap.neural.training.blocks import Block, Headed
from simgap.neural.training.linear_blocks import Filtered, Mixed, Static, Stacked
from simgap.neural.training.network import Network
from simgap.registry import MODELS


@MODELS.register("dynonet")
@dataclass
class DynoNet(Network):
    """FC(channels) - G - F - G - FC(ny): transfer functions G of order 2 `sections`, a static network F between."""

    channels: int = 16
    sections: int = 2
    hidden: int = 32

    def net(self, inputs: int, outputs: int) -> Block:
        """Build an untrained network with random weights."""
        before, behind = (Filtered(self.channels, self.sections, (0.4, 0.95), 1.0) for _ in range(2))
        body = Stacked([Mixed(inputs, self.channels), before, Static(self.channels, self.hidden), behind])
        return Headed(body, self.channels, outputs)
