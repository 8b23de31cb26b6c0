"""Blocks of linear recurrences, and the static networks between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor, nn

from simgap.neural.training.blocks import Block
from simgap.neural.training.convolution import full
from simgap.neural.training.linear import Diagonal, Filters

BENT = 3.0  # standard deviation of what a static network bends, of channels of size one


class Stacked(Block):
    """Blocks, one on top of the other."""

    def __init__(self, blocks: Sequence[Block]) -> None:
        super().__init__()
        self.blocks: Any = nn.ModuleList(blocks)

    def forward(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T G"]:
        """Compute the features of the uppermost block."""
        for block in self.blocks:
            x = block(x)
        return x

    def last(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B G"]:
        """Compute the last features of the uppermost block."""
        *lower, upper = self.blocks
        for block in lower:
            x = block(x)
        return upper.last(x)


class Pointwise(Block):
    """A block without memory: the same function at each sample; a subclass writes `forward` for any leading axes."""

    def last(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B G"]:
        """Compute the features at the last sample."""
        return self.forward(x[:, -1])


class Entry(Pointwise):
    """W [x, u g] + b: the features x of a sample; `gated` inputs u come once more while outputs are measured (g = 1).

    With these, a linear filter can compare what was measured with what it makes of the inputs, and so find its state.
    """

    def __init__(self, inputs: int, channels: int, gated: int = 0) -> None:
        super().__init__()
        self.gated, self.full = gated, full(inputs + gated, channels)

    def forward(self, x: Float[Tensor, "*B F"]) -> Float[Tensor, "*B G"]:
        """Compute the channels; g is the last feature."""
        return self.full(torch.cat((x, x[..., : self.gated] * x[..., -1:]), dim=-1))


class Static(Pointwise):
    """F(x) = x + W2 tanh(W1 x + b1) + b2: the static network of dynoNet, with a way around that keeps linear plants."""

    def __init__(self, channels: int, hidden: int) -> None:
        super().__init__()
        self.inner, self.outer = full(channels, hidden), full(hidden, channels)
        # Glorot's weights without offsets begin nearly linear and odd, and many trainings stay there.
        nn.init.normal_(self.inner.weight, std=BENT / math.sqrt(channels))
        nn.init.uniform_(self.inner.bias, -1, 1)

    def forward(self, x: Float[Tensor, "*B F"]) -> Float[Tensor, "*B F"]:
        """Compute F(x)."""
        return x + self.outer(torch.tanh(self.inner(x)))


class Filtered(Block):
    """A transfer function for each channel."""

    def __init__(self, channels: int, sections: int, radii: tuple[float, float], angle: float) -> None:
        super().__init__()
        self.filters = Filters(channels, sections, radii, angle)

    def forward(self, x: Float[Tensor, "B T C"]) -> Float[Tensor, "B T C"]:
        """Filter from rest."""
        return self.filters.over(x)

    def last(self, x: Float[Tensor, "B T C"]) -> Float[Tensor, "B C"]:
        """Filter from rest and give the last sample."""
        return self.filters.over(x)[:, -1]


class Lru(Block):
    """x + GLU(LRU(x)), GLU(y) = (W y + b) sigmoid(V y + c) (Orvieto et al. 2023).

    Without the paper's normalisation of the features, which would take the amplitude of a signal away.
    """

    def __init__(
        self, features: int, states: int, radii: tuple[float, float], angle: float, dropout: float = 0.0
    ) -> None:
        super().__init__()
        self.recurrence = Diagonal(features, states, radii, angle)
        self.value, self.gate = full(features, features), full(features, features)
        self.dropout = nn.Dropout(dropout)

    def forward(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T F"]:
        """Compute the features at all samples."""
        return self._gated(x, self.recurrence.states(x))

    def last(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B F"]:
        """Compute the features at the last sample."""
        return self._gated(x[:, -1], self.recurrence.states(x)[:, -1])

    def _gated(self, x: Tensor, s: Tensor) -> Tensor:
        y = self.recurrence.outputs(x, s)
        return x + self.dropout(self.value(y) * torch.sigmoid(self.gate(y)))
