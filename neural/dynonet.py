"""dynoNet: Forgione and Piga, Int. J. Adaptive Control and Signal Processing 35(4), 2021."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from simgap.neural.training.blocks import Block, Headed
from simgap.neural.training.linear_blocks import Entry, Filtered, Stacked, Static
from simgap.neural.training.network import STATEFUL, Network
from simgap.registry import MODELS

RADII, ANGLE = (0.4, 0.95), 1.0  # of the poles at first


@MODELS.register("dynonet")
@dataclass
class DynoNet(Network):
    """FC(channels) - G - F - G - FC(ny): transfer functions G of order 2 `sections`, a static network F between.

    The paper's matrix of transfer functions is here one for each channel, between fully connected layers. Stateful, it
    has a recipe of its own and longer pieces, as chosen on the validation parts of Wiener-Hammerstein, Silverbox and
    the tanks. On the first it ends by itself, after 280 to 640 epochs.
    """

    stateful: ClassVar = replace(STATEFUL, epochs=800, learning_rate=1e-2, patience=8, early_stop=40)
    free: ClassVar[int] = 300

    channels: int = 8
    sections: int = 3
    hidden: int = 32

    def net(self, inputs: int, outputs: int) -> Block:
        """Build an untrained network with random weights."""
        entry = Entry(inputs, self.channels, 0 if self.windowed else inputs - outputs - 1)
        before, behind = (Filtered(self.channels, self.sections, RADII, ANGLE) for _ in range(2))
        static = Static(self.channels, self.hidden)
        return Headed(Stacked([entry, before, static, behind]), self.channels, outputs)
