"""Neural ordinary differential equation: Chen, Rubanova, Bettencourt and Duvenaud, NeurIPS 2018, with an integrator."""

from __future__ import annotations

from dataclasses import dataclass

from simgap.neural.subnet import Subnet
from simgap.neural.training.blocks import Block
from simgap.registry import MODELS


@MODELS.register("neural-ode")
@dataclass
class NeuralOde(Subnet):
    """dy/dt = g(y, x, u), dx/dt = f(y, x, u), one Euler step per sample; y begins at the last measured outputs.

    The outputs are states of their own, integrated from what the others say, as plants need that move and do not
    return; otherwise it is `subnet`.
    """

    def net(self, inputs: int, outputs: int) -> Block:
        """Build an untrained network with random weights."""
        return self.state_space(inputs, outputs, outputs)
