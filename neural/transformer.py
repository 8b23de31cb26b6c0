"""A causal Transformer, which the paper names as the next thing to try."""

from __future__ import annotations

from dataclasses import dataclass

from simgap.neural.training.attention import Attending
from simgap.neural.training.blocks import Block, Headed
from simgap.neural.training.linear_blocks import Entry, Stacked
from simgap.neural.training.network import Network
from simgap.records import UnusableInput
from simgap.registry import MODELS


@MODELS.register("transformer")
@dataclass
class Transformer(Network):
    """FC(units) - layers x [attention to `span` samples, network at each sample] - FC(ny).

    It holds no state: an output depends on its own sample and on layers x (span - 1) before it, and on nothing older.
    What a plant keeps for longer, an integrator above all, is beyond it.
    """

    units: int = 24
    heads: int = 1
    layers: int = 3
    span: int = 32

    def net(self, inputs: int, outputs: int) -> Block:
        """Build an untrained network with random weights."""
        layers = [
            Attending(self.units, self.heads, self.span, 2 * self.units, self.dropout) for _ in range(self.layers)
        ]
        return Headed(Stacked([Entry(inputs, self.units), *layers]), self.units, outputs)

    def check(self) -> None:
        """Raise UnusableInput for hyper-parameters that make no sense."""
        super().check()
        if self.units % self.heads:
            raise UnusableInput(f"the {self.units} units of a Transformer do not divide into {self.heads} heads")
