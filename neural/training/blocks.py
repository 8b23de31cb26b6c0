"""Parts of networks that all can do two things: every sample of a sequence, or only the last sample of a window."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from jaxtyping import Float
from torch import Tensor, nn

from simgap.neural.training.recurrent import Layer


class Block(nn.Module):
    """A causal part: `forward` gives the features at all samples, `last` those at the last one."""

    def forward(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T G"]:
        """Features at all samples; those at sample k depend on nothing after k."""
        raise NotImplementedError

    def last(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B G"]:
        """Features at the last sample."""
        raise NotImplementedError


class Recurrences(Block):
    """Recurrent layers, one on top of the other."""

    def __init__(self, layers: Sequence[Layer]) -> None:
        super().__init__()
        self.layers = nn.ModuleList(layers)

    def forward(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T G"]:
        """States of the uppermost layer."""
        for layer in self.layers:
            x = layer.states(x)
        return x

    def last(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B G"]:
        """Last state of the uppermost layer."""
        *lower, upper = self.layers
        for layer in lower:
            x = layer.states(x)
        return upper.last(x)


class Pooled(Block):
    """Two convolutions over time with average pooling, and a fully connected layer over what is left of the window.

    conv(F, C, k) - ReLU - mean of 2 - conv(C, C, k) - ReLU - mean of 2 - FC(C). A sequence is a window at every sample:
    then the layers after a pooling leave out samples instead (Shensa 1992, the algorithm "a trous").
    """

    def __init__(self, inputs: int, channels: int, kernel: int, window: int) -> None:
        super().__init__()
        self.window = window
        self.first = nn.Conv1d(inputs, channels, kernel)
        self.second = nn.Conv1d(channels, channels, kernel)
        self.full = nn.Conv1d(channels, channels, max(1, window // 4))
        for conv in (self.first, self.second, self.full):
            initialise(conv)

    def forward(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T G"]:
        """Features of the window that ends at each sample; before the start there are zeros."""
        x = torch.relu(causal(self.first, x.transpose(1, 2), 1))
        x = (x + before(x, 1)) / 2
        x = torch.relu(causal(self.second, x, 2))
        x = (x + before(x, 2)) / 2
        return torch.relu(causal(self.full, x, 4)).transpose(1, 2)

    def last(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B G"]:
        """Features of the window, of which a remainder of fewer than four samples is left out at its start."""
        x = x[:, len(x[0]) % 4 :].transpose(1, 2)
        x = nn.functional.avg_pool1d(torch.relu(causal(self.first, x, 1)), 2)
        x = nn.functional.avg_pool1d(torch.relu(causal(self.second, x, 1)), 2)
        return torch.relu(torch.addmm(self.full.bias, x.flatten(1), self.full.weight.flatten(1).t()))


class Tcn(Block):
    """Temporal convolutional network: residual blocks of two dilated causal convolutions (Bai, Kolter, Koltun 2018).

    y = ReLU(x + F(x)), F = conv - ReLU - dropout - conv - ReLU - dropout, dilation 1, 2, 4, ... from block to block;
    x passes through a 1 x 1 convolution where the number of channels changes.
    """

    def __init__(self, inputs: int, channels: int, kernel: int, blocks: int, dropout: float = 0.0) -> None:
        super().__init__()
        sizes = [inputs] + [channels] * blocks
        self.one = nn.ModuleList(nn.Conv1d(size, channels, kernel) for size in sizes[:-1])
        self.two = nn.ModuleList(nn.Conv1d(channels, channels, kernel) for _ in sizes[:-1])
        self.through = nn.Conv1d(inputs, channels, 1)
        self.dropout = nn.Dropout(dropout)
        for conv in (*self.one, *self.two, self.through):
            initialise(conv)

    def forward(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T G"]:
        """Features at all samples; before the start there are zeros."""
        x = x.transpose(1, 2)
        for level in range(len(self.one)):
            x = self._block(x, level, 2**level)
        return x.transpose(1, 2)

    def last(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B G"]:
        """The same at the last sample: a block of dilation d needs every d-th sample only, counted from the end."""
        x = x.transpose(1, 2)
        for level in range(len(self.one)):
            if level:
                x = x[:, :, (x.shape[2] - 1) % 2 :: 2]
            x = self._block(x, level, 1)
        return x[:, :, -1]

    def _block(self, x: Tensor, level: int, dilation: int) -> Tensor:
        inner = x
        for conv in (self.one[level], self.two[level]):
            inner = self.dropout(torch.relu(causal(conv, inner, dilation)))
        return torch.relu(inner + (x if level else self.through(x)))


def causal(conv: nn.Conv1d, x: Float[Tensor, "B F T"], dilation: int) -> Float[Tensor, "B G T"]:
    """The convolution with zeros before the first sample."""
    x = nn.functional.pad(x, ((conv.kernel_size[0] - 1) * dilation, 0))
    return nn.functional.conv1d(x, conv.weight, conv.bias, dilation=dilation)


def before(x: Float[Tensor, "B F T"], samples: int) -> Float[Tensor, "B F T"]:
    """The signal so many samples earlier, zero before its start."""
    return nn.functional.pad(x, (samples, 0))[:, :, : x.shape[2]]


def initialise(layer: nn.Conv1d | nn.Linear) -> None:
    """Initial weights as in Keras: Glorot uniform, offsets zero."""
    nn.init.xavier_uniform_(layer.weight)
    if layer.bias is not None:
        nn.init.zeros_(layer.bias)


def full(inputs: int, outputs: int) -> nn.Linear:
    """A fully connected layer."""
    layer = nn.Linear(inputs, outputs)
    initialise(layer)
    return layer


class Headed(Block):
    """A block and a fully connected layer to the outputs."""

    def __init__(self, body: Block, features: int, outputs: int) -> None:
        super().__init__()
        self.body, self.head = body, full(features, outputs)

    def forward(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T G"]:
        """Outputs at all samples."""
        return self.head(self.body(x))

    def last(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B G"]:
        """Outputs at the last sample."""
        return self.head(self.body.last(x))


class Parallel(Block):
    """Blocks side by side, then fully connected layers with a skip connection.

    z = [features of all blocks]; FC(hidden) - ReLU - FC(size of z), plus z.
    """

    def __init__(self, blocks: Sequence[Block], features: int, hidden: int, dropout: float = 0.0) -> None:
        super().__init__()
        self.blocks = nn.ModuleList(blocks)
        self.dropout = nn.Dropout(dropout)
        self.narrow, self.wide = full(features, hidden), full(hidden, features)

    def forward(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T G"]:
        """Features at all samples."""
        return self._joined(torch.cat([block(x) for block in self.blocks], dim=2))

    def last(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B G"]:
        """Features at the last sample."""
        return self._joined(torch.cat([block.last(x) for block in self.blocks], dim=1))

    def _joined(self, z: Tensor) -> Tensor:
        z = self.dropout(z)
        return z + self.wide(torch.relu(self.narrow(z)))
