"""Causal attention that reaches back a fixed number of samples, and the layers of a Transformer."""

from __future__ import annotations

import math

import torch
from jaxtyping import Float
from torch import Tensor, nn

from simgap.neural.training.blocks import Block
from simgap.neural.training.convolution import full


class Attention(nn.Module):
    """Each sample looks at itself and the span - 1 before it (Vaswani et al. 2017; a sliding window as Beltagy 2020).

    y(t) = W sum_j a_j(t) v(t - j), a(t) = softmax over j < span of q(t)' k(t - j) / sqrt(d) + b_j, in heads of size d.
    The offsets b_j belong to delays and not to times (Raffel et al. 2020): a free run may be longer than those of the
    training. Before the start keys and values are zero.
    """

    delay: Tensor
    seen: Tensor

    def __init__(self, features: int, heads: int, span: int) -> None:
        super().__init__()
        self.heads, self.span = heads, span
        self.qkv, self.out = full(features, 3 * features), full(features, features)
        self.offsets = nn.Parameter(torch.zeros(heads, span))
        delay = span + torch.arange(span)[:, None] - torch.arange(2 * span)[None]  # of keys in this block and the last
        self.register_buffer("delay", delay.clamp(0, span - 1), persistent=False)
        self.register_buffer("seen", (delay >= 0) & (delay < span), persistent=False)

    def forward(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T F"]:
        """Attend in blocks of `span` samples, each to itself and to the one before it."""
        steps, size = x.shape[1], x.shape[2] // self.heads
        blocks = -(-steps // self.span)
        qkv = nn.functional.pad(self.qkv(x), (0, 0, 0, blocks * self.span - steps))
        q, k, v = qkv.unflatten(2, (3, self.heads, size)).unflatten(1, (blocks, self.span)).permute(3, 0, 4, 1, 2, 5)
        offsets = self.offsets[:, self.delay].masked_fill(~self.seen, -math.inf)
        score = (q / math.sqrt(size)) @ _with_last(k).transpose(-1, -2)  # [B, H, blocks, span, 2 span]
        y = torch.softmax(score + offsets[:, None], dim=-1) @ _with_last(v)
        return self.out(y.permute(0, 2, 3, 1, 4).flatten(3).flatten(1, 2)[:, :steps])


def _with_last(x: Float[Tensor, "B H N S d"]) -> Float[Tensor, "B H N 2*S d"]:
    """Put before each block the one before it, and zeros before the first."""
    return torch.cat((nn.functional.pad(x, (0, 0, 0, 0, 1, 0))[:, :, :-1], x), dim=3)


class Attending(Block):
    """x + Attention(N x), then x + W2 ReLU(W1 N x), N the normalisation of a sample's features (Xiong et al. 2020)."""

    def __init__(self, features: int, heads: int, span: int, hidden: int, dropout: float = 0.0) -> None:
        super().__init__()
        self.attention = Attention(features, heads, span)
        self.before, self.between = nn.LayerNorm(features), nn.LayerNorm(features)
        self.wide, self.narrow = full(features, hidden), full(hidden, features)
        self.dropout = nn.Dropout(dropout)

    def forward(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T F"]:
        """Compute the features at all samples."""
        x = x + self.dropout(self.attention(self.before(x)))
        return x + self.dropout(self.narrow(torch.relu(self.wide(self.between(x)))))

    def last(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B F"]:
        """Compute the features at the last sample."""
        return self.forward(x)[:, -1]
