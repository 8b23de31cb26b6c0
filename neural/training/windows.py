"""The paper's way: a window of inputs in, the next sample of the outputs out; no state, no measured output."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from simgap.neural.training.blocks import Block
from simgap.neural.training.examples import Examples, long_enough
from simgap.neural.training.scaling import Scaling, features
from simgap.records import Experiment, UnusableInput

SOME = 256  # windows whose slopes are computed


class Windows(Examples):
    """All windows of some experiments: x(k-W) .. x(k-1) with y(k), for every k that has W samples before it.

    A window lies within one experiment and is a view. `resident`: the scaled data are held in memory as float32;
    otherwise a batch is made from the experiments when it is asked for (paper, 3.2), so that experiments whose arrays
    are memory maps are read piece by piece.
    """

    def __init__(
        self, experiments: Sequence[Experiment], of_x: Scaling, of_y: Scaling, window: int, time: bool, resident: bool
    ) -> None:
        self.window, self.time, self.of_x, self.of_y = window, time, of_x, of_y
        self.experiments = long_enough(experiments, window + 1)
        if not self.experiments:
            raise UnusableInput(f"no experiment is longer than the window of {window} samples; choose a smaller window")
        counts = [len(x) - window for x in self.experiments]
        self.ends = np.cumsum(counts)
        self.in_memory: tuple[Tensor, Tensor] | None = None
        if resident:
            x = np.concatenate([of_x.inside(features(e.u, e.dt, time)) for e in self.experiments])
            y = np.concatenate([of_y.inside(e.y) for e in self.experiments])
            views = torch.from_numpy(x.astype(np.float32)).unfold(0, window, 1).transpose(1, 2)
            self.in_memory = views, torch.from_numpy(y.astype(np.float32))
            firsts = np.concatenate(([0], np.cumsum([len(e) for e in self.experiments])[:-1]))
            rows = [first + np.arange(count) for first, count in zip(firsts, counts, strict=True)]
            self.rows = torch.from_numpy(np.concatenate(rows))

    def __len__(self) -> int:
        return int(self.ends[-1])

    def batch(self, chosen: Int[Tensor, " B"]) -> tuple[Float[Tensor, "B W F"], Float[Tensor, "B ny"]]:
        """Give inputs and targets of the chosen windows, scaled."""
        if self.in_memory is not None:
            views, y = self.in_memory
            rows = self.rows[chosen]
            return views[rows], y[rows + self.window]
        which = np.searchsorted(self.ends, chosen.numpy(), side="right")
        xs, ys = [], []
        for i, end in zip(which, chosen.numpy() - self.ends[which], strict=True):
            e = self.experiments[i]
            k = len(e) + int(end)  # the target
            u = e.u[k - self.window : k]
            t = e.dt * np.arange(k - self.window, k)
            xs.append(np.column_stack((t, u)) if self.time else u)
            ys.append(e.y[k])
        x, y = self.of_x.inside(np.stack(xs)), self.of_y.inside(np.stack(ys))
        return torch.from_numpy(x.astype(np.float32)), torch.from_numpy(y.astype(np.float32))

    def answer(self, net: Block, x: Float[Tensor, "B W F"]) -> Float[Tensor, "B ny"]:
        """Compute the network's outputs for a batch."""
        return net.last(x)


def reach(net: Block, windows: Windows) -> float:
    """Compute how much of an output's slope belongs to the older half of its window: 0 where gradients vanish.

        sum_{k < W/2} |dy/dx_k| / sum_k |dy/dx_k|

    over some windows, spread evenly (Bengio, Simard and Frasconi, IEEE Trans. Neural Networks 5, 1994).
    """
    chosen = torch.linspace(0, len(windows) - 1, min(len(windows), SOME), dtype=torch.double).round().long()
    x = windows.batch(chosen)[0].clone().requires_grad_()
    slopes = [torch.autograd.grad(y.sum(), x, retain_graph=True)[0] for y in net.last(x).unbind(1)]
    sizes = torch.stack(slopes).abs().sum(dim=(0, 1, 3))  # [W]
    return float(sizes[: windows.window // 2].sum() / sizes.sum().clamp(min=1e-30))


def simulate(
    net: Block, x: Float[Tensor, "B T F"], n: int, window: int, at_once: int = 1024
) -> Float[Tensor, "B N ny"]:
    """Simulate rows n .. T-1 of B experiments; before their start the inputs stood still."""
    before = x[:, :1].expand(-1, max(0, window - n), -1)
    padded = torch.cat((before, x[:, max(0, n - window) : -1]), dim=1)
    views = padded.unfold(1, window, 1).transpose(2, 3)  # [B, N, W, F]
    flat = views.reshape(-1, *views.shape[2:]) if len(x) > 1 else views[0]
    return torch.cat([net.last(part) for part in flat.split(at_once)]).unflatten(0, views.shape[:2])
