"""Neural ordinary differential equation: Chen, Rubanova, Bettencourt and Duvenaud, NeurIPS 2018, with an integrator."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from simgap.neural.training.blocks import Block
from simgap.neural.training.network import LONG, Network
from simgap.neural.training.state_space import StateSpace
from simgap.registry import MODELS


@MODELS.register("neural-ode")
@dataclass
class NeuralOde(Network):
    """dy/dt = g(y, x, u), dx/dt = f(y, x, u), one Euler step per sample; y begins at the last measured outputs.

    The outputs are states of their own, integrated from what the others say, as plants need that move and do not
    return (Beintema et al. 2023 for the encoder that finds x).
    """

    stateful: ClassVar = replace(LONG, epochs=700, learning_rate=5e-3, patience=25, early_stop=120)
    free: ClassVar[int] = 300

    pairs: int = 4
    hidden: int = 32
    past: int = 10

    def net(self, inputs: int, outputs: int) -> Block:
        """Build an untrained network with random weights."""
        measured = 0 if self.windowed else outputs + 1
        return StateSpace(inputs, measured, self.pairs, self.hidden, self.past, outputs)
