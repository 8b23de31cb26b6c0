"""The stateful way: the network reads n_init measured samples, keeps their state and runs free over the record."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from simgap.neural.training.blocks import Block
from simgap.neural.training.examples import Examples, long_enough
from simgap.neural.training.scaling import Scaling
from simgap.records import Experiment, UnusableInput

# Samples of a free run in training, and from how many different starts.
FREE = 160
STARTS = 6400


class Sequences(Examples):
    """Pieces of experiments: n measured samples to find the state, then a free run of up to `free` samples;
    at most `starts` of them, evenly spread.

    Features of sample k are u(k), y(k) and 1 as long as k < n, afterwards u(k), 0 and 0. All pieces have one length.
    Experiments shorter than it are left out, with a warning; so where many are short, the pieces are.
    """

    def __init__(
        self, experiments: Sequence[Experiment], of_u: Scaling, of_y: Scaling, n: int,
        free: int = FREE, starts: int = STARTS,
    ) -> None:  # fmt: skip
        self.n = n
        self.length = _length([len(x) for x in experiments], n, free)
        usable = long_enough(experiments, self.length)
        u = np.concatenate([of_u.inside(x.u) for x in usable])
        y = np.concatenate([of_y.inside(x.y) for x in usable])
        signals = torch.from_numpy(np.concatenate((u, y), axis=1).astype(np.float32))
        self.views = signals.unfold(0, self.length, 1).transpose(1, 2)  # [N, L, nu + ny]
        self.nu = u.shape[1]
        firsts = np.concatenate(([0], np.cumsum([len(x) for x in usable])[:-1]))
        rows = np.concatenate(
            [first + np.arange(len(x) - self.length + 1) for first, x in zip(firsts, usable, strict=True)]
        )
        spread = np.linspace(0, len(rows) - 1, min(starts, len(rows))).round().astype(int)
        self.rows = torch.from_numpy(rows[spread])

    def __len__(self) -> int:
        return len(self.rows)

    def batch(self, chosen: Int[Tensor, " B"]) -> tuple[Float[Tensor, "B L F"], Float[Tensor, "B K ny"]]:
        """Give features of the chosen pieces, and the outputs of their free runs."""
        pieces = self.views[self.rows[chosen]]
        u, y = pieces[:, :, : self.nu], pieces[:, :, self.nu :]
        return with_start(u, y[:, : self.n]), y[:, self.n :]

    def answer(self, net: Block, x: Float[Tensor, "B L F"]) -> Float[Tensor, "B K ny"]:
        """Compute the network's outputs for a batch, without the samples that found the state."""
        return net(x)[:, self.n :]


def _length(lengths: Sequence[int], n: int, free: int) -> int:
    """Choose the length of a piece: the one whose free runs are long and leave out few samples."""
    lengths = [length for length in lengths if length > n]
    if not lengths:
        raise UnusableInput(f"no experiment is longer than the {n} samples that find the state")
    choices = {min(length, n + free) for length in lengths}
    return max(choices, key=lambda piece: (piece - n) * sum(length - n for length in lengths if length >= piece))


def with_start(u: Float[Tensor, "B T nu"], y: Float[Tensor, "B n ny"]) -> Float[Tensor, "B T F"]:
    """Make the features of a run that starts with n measured samples."""
    free = u.shape[1] - y.shape[1]
    measured = torch.cat((y, torch.ones_like(y[:, :, :1])), dim=2)
    return torch.cat((u, torch.nn.functional.pad(measured, (0, 0, 0, free))), dim=2)


def simulate(net: Block, u: Float[Tensor, "B T nu"], y: Float[Tensor, "B n ny"]) -> Float[Tensor, "B N ny"]:
    """Simulate rows n .. T-1 of B experiments from their n measured samples."""
    return net(with_start(u, y))[:, y.shape[1] :]
