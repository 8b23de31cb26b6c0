"""Parts of networks that all can do two things: every sample of a sequence, or only the last sample of a window."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor, nn

from simgap.neural.training.convolution import Convolution, Residual, full, pooled
from simgap.neural.training.recurrent import Layer


class Block(nn.Module):
    """A causal part: `forward` gives the features at all samples, `last` those at the last one."""

    def forward(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T G"]:
        """Compute the features at all samples; those at sample k depend on nothing after k."""
        raise NotImplementedError

    def last(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B G"]:
        """Compute the features at the last sample."""
        raise NotImplementedError


class Recurrences(Block):
    """Recurrent layers, one on top of the other."""

    def __init__(self, layers: Sequence[Layer]) -> None:
        super().__init__()
        self.layers: Any = nn.ModuleList(layers)

    def forward(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T G"]:
        """Compute the states of the uppermost layer."""
        for layer in self.layers:
            x = layer.states(x)
        return x

    def last(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B G"]:
        """Compute the last state of the uppermost layer."""
        *lower, upper = self.layers
        for layer in lower:
            x = layer.states(x)
        return upper.last(x)


class Pooled(Block):
    """Two convolutions over time with average pooling, and a fully connected layer over what is left of the window.

    conv(F, C, k) - ReLU - mean of 2 - conv(C, C, k) - ReLU - mean of 2 - FC(C) - ReLU. A sequence is a window at every
    sample: then what follows a pooling leaves out samples instead (Holschneider 1989, the algorithm "a trous").
    """

    def __init__(self, inputs: int, channels: int, kernel: int, window: int) -> None:
        super().__init__()
        self.first = Convolution(inputs, channels, kernel)
        self.second = Convolution(channels, channels, kernel)
        self.full = Convolution(channels, channels, window // 4)
        nn.init.xavier_uniform_(self.full.weight.data.flatten(1))  # as the fully connected layer that it is

    def forward(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T G"]:
        """Compute the features of the window that ends at each sample; before the start there are zeros."""
        x = self.first.over(x)
        x = (x + _before(x, 1)) / 2
        x = self.second.over(x, 2)
        x = (x + _before(x, 2)) / 2
        return self.full.over(x, 4)

    def last(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B G"]:
        """Compute the features of the window; a remainder of fewer than four samples is left out at its start."""
        return pooled(x[:, x.shape[1] % 4 :], self.first, self.second, self.full)


class Tcn(Block):
    """Temporal convolutional network: residual blocks of dilation 1, 2, 4, ... (Bai, Kolter and Koltun 2018)."""

    def __init__(self, inputs: int, channels: int, kernel: int, blocks: int, dropout: float = 0.0) -> None:
        super().__init__()
        sizes = [inputs] + [channels] * (blocks - 1)
        self.blocks: Any = nn.ModuleList(Residual(size, channels, kernel, dropout) for size in sizes)

    def forward(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T G"]:
        """Compute the features at all samples; before the start there are zeros."""
        for level, block in enumerate(self.blocks):
            x = block.over(x, 2**level)
        return x

    def last(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B G"]:
        """Compute the features at the last sample.

        The next block reads only every d-th sample of one of dilation d, counted from the end, and of the uppermost one
        counts. The others are not computed, and in the subsampled sequence every dilation is 1.
        """
        *lower, upper = self.blocks
        for block in lower:
            x = block.over(x, step=2)
        return upper.over(x, step=x.shape[1])[:, 0]


def _before(x: Float[Tensor, "B T F"], samples: int) -> Float[Tensor, "B T F"]:
    """Delay the signal by so many samples, with zeros before its start."""
    return nn.functional.pad(x, (0, 0, samples, 0))[:, : x.shape[1]]


class Headed(Block):
    """A block and a fully connected layer to the outputs."""

    def __init__(self, body: Block, features: int, outputs: int) -> None:
        super().__init__()
        self.body, self.head = body, full(features, outputs)

    def forward(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T G"]:
        """Compute the outputs at all samples."""
        return self.head(self.body(x))

    def last(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B G"]:
        """Compute the outputs at the last sample."""
        return self.head(self.body.last(x))


class Parallel(Block):
    """Blocks side by side, then fully connected layers with a skip connection.

    z = [features of all blocks]; FC(hidden) - ReLU - FC(size of z), plus z. `dropout` acts on z, `last_dropout` behind.
    """

    def __init__(
        self, blocks: Sequence[Block], features: int, hidden: int, dropout: float = 0.0, last_dropout: float = 0.0
    ) -> None:
        super().__init__()
        self.blocks: Any = nn.ModuleList(blocks)
        self.dropout, self.last_dropout = nn.Dropout(dropout), nn.Dropout(last_dropout)
        self.narrow, self.wide = full(features, hidden), full(hidden, features)

    def forward(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T G"]:
        """Compute the features at all samples."""
        return self._joined(torch.cat([block(x) for block in self.blocks], dim=2))

    def last(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B G"]:
        """Compute the features at the last sample."""
        return self._joined(torch.cat([block.last(x) for block in self.blocks], dim=1))

    def _joined(self, z: Tensor) -> Tensor:
        z = self.dropout(z)
        return self.last_dropout(z + self.wide(torch.relu(self.narrow(z))))
