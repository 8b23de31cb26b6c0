"""Deep subspace encoder: Beintema, Toth, Schoukens, L4DC 2021; Beintema, Schoukens, Toth, Automatica 156, 2023."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from simgap.neural.training.blocks import Block, Headed
from simgap.neural.training.linear_blocks import Stacked, Static
from simgap.neural.training.network import STATEFUL, Network
from simgap.neural.training.state_space import StateSpace
from simgap.registry import MODELS


@MODELS.register("subnet")
@dataclass
class Subnet(Network):
    """x(n) = psi(last `past` inputs and outputs), x(k+1) = f(x(k), u(k)), y(k) = h(x(k), u(k)), all networks.

    f is linear, with poles that stay inside the unit circle, and a bounded network beside it, where the paper has a
    network with a linear way around; the encoder sees measured samples only as far as the task gives them. How long it
    trains was chosen on the validation part of the Silverbox: 0.51 mV after 160 epochs, 0.25 after 700.
    """

    stateful: ClassVar = replace(STATEFUL, epochs=700, learning_rate=5e-3, patience=25, early_stop=120)
    free: ClassVar[int] = 300

    pairs: int = 4
    hidden: int = 32
    past: int = 10

    def net(self, inputs: int, outputs: int) -> Block:
        """Build an untrained network with random weights."""
        body = self.state_space(inputs, outputs)
        features = body.size + body.nu
        return Headed(Stacked([body, Static(features, self.hidden)]), features, outputs)

    def state_space(self, inputs: int, outputs: int, integrated: int = 0) -> StateSpace:
        """Build the encoder and the map of the states."""
        measured = 0 if self.windowed else outputs + 1
        return StateSpace(inputs, measured, self.pairs, self.hidden, self.past, integrated)
