"""Linear recurrences as layers: complex states that do not meet (LRU), and transfer functions (dynoNet).

On the CPU the pass through time and its adjoint are compiled loops; elsewhere the scan doubles its reach at each step.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from simgap.neural.training import linear_kernels

kernels: Any = linear_kernels  # compiled, and so are the checks of their arguments


class _Diagonal(torch.autograd.Function):
    """v [B, T, 2N] and the poles [N] to the states [B, T, 2N]."""

    @staticmethod
    def forward(ctx: Any, v: Tensor, re: Tensor, im: Tensor) -> Tensor:
        poles = re.detach().numpy(), im.detach().numpy()
        s = np.empty(v.shape, poles[0].dtype)
        kernels.run_diagonal(v.detach().contiguous().numpy(), *poles, s)
        ctx.rest = *poles, s
        return torch.from_numpy(s)

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor, ...]:
        re, im, s = ctx.rest
        gradients = np.empty_like(s), np.empty_like(re), np.empty_like(im)
        kernels.back_diagonal(re, im, s, grads[0].contiguous().numpy(), *gradients)
        return tuple(map(torch.from_numpy, gradients))


class _Section(torch.autograd.Function):
    """x [B, T, C] through y = B/A x with B [3, C] and A = 1 + a1 q^-1 + a2 q^-2, a [2, C]."""

    @staticmethod
    def forward(ctx: Any, x: Tensor, num: Tensor, den: Tensor) -> Tensor:
        arrays = [value.detach().contiguous().numpy() for value in (x, num, den)]
        y = np.empty_like(arrays[0])
        kernels.run_section(*arrays, y)
        ctx.rest = *arrays, y
        return torch.from_numpy(y)

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor, ...]:
        x, num, den, y = ctx.rest
        gradients = np.empty_like(x), np.empty_like(num), np.empty_like(den)
        kernels.back_section(x, num, den, y, grads[0].contiguous().numpy(), *gradients)
        return tuple(map(torch.from_numpy, gradients))


def scan(v: Float[Tensor, "B T C n"], a: Float[Tensor, "C n n"]) -> Float[Tensor, "B T C n"]:
    """Compute s(k) = A s(k-1) + v(k) for each of C channels in log2(T) steps of PyTorch's operations.

    After a step that adds A^d s(k-d), s(k) holds the last 2d samples (Hillis and Steele 1986).
    """
    d = 1
    while d < v.shape[1]:
        v = torch.cat((v[:, :d], v[:, d:] + torch.einsum("cij,btcj->btci", a, v[:, :-d])), dim=1)
        a, d = a @ a, 2 * d
    return v


class Diagonal(nn.Module):
    """s(k) = lambda s(k-1) + gamma B x(k), y(k) = Re(C s(k)) + D x(k) with N complex states (Orvieto et al. 2023).

    |lambda| = exp(-exp(nu)) < 1 for whatever weights, its angle exp(theta): at first a ring between `radii`, angles up
    to `angle`. `weight_out` [F, 2N] is C with the sign of its imaginary part turned, as it multiplies [Re s, Im s].
    """

    def __init__(self, features: int, states: int, radii: tuple[float, float], angle: float) -> None:
        super().__init__()
        low, high = radii
        size = torch.sqrt(torch.rand(states) * (high**2 - low**2) + low**2)
        self.nu = nn.Parameter(torch.log(-torch.log(size)))
        self.theta = nn.Parameter(torch.log(angle * torch.rand(states)))
        self.gamma = nn.Parameter(0.5 * torch.log1p(-(size**2)))
        self.weight_in = nn.Parameter(torch.randn(2 * states, features) / math.sqrt(2 * features))
        self.weight_out = nn.Parameter(torch.randn(features, 2 * states) / math.sqrt(states))
        self.through = nn.Parameter(torch.randn(features))

    def poles(self) -> tuple[Float[Tensor, " N"], Float[Tensor, " N"]]:
        """Give the real and imaginary parts of lambda."""
        size, angle = torch.exp(-torch.exp(self.nu)), torch.exp(self.theta)
        return size * torch.cos(angle), size * torch.sin(angle)

    def entry(self) -> Float[Tensor, "S F"]:
        """Give gamma B, real parts first, S = 2N: from a white input it makes states of equal size."""
        return torch.exp(self.gamma).repeat(2)[:, None] * self.weight_in

    def states(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T S"]:
        """Compute the states at all samples, real parts first."""
        v, (re, im) = nn.functional.linear(x, self.entry()), self.poles()
        if x.device.type == "cpu":
            return _Diagonal.apply(v, re, im)  # type: ignore[no-any-return]
        a = torch.stack((torch.stack((re, -im), 1), torch.stack((im, re), 1)), 1)  # [N, 2, 2]
        return scan(v.unflatten(2, (2, -1)).transpose(2, 3), a).transpose(2, 3).flatten(2)

    def outputs(self, x: Float[Tensor, "*B F"], s: Float[Tensor, "*B S"]) -> Float[Tensor, "*B F"]:
        """Read the outputs off the states."""
        return nn.functional.linear(s, self.weight_out) + self.through * x


class Filters(nn.Module):
    """y_c = G_c(q) x_c, a transfer function for each of C channels (Forgione and Piga 2021).

    Numerator and denominator are products of `sections` of order two. 1 + a1 q^-1 + a2 q^-2 is stable for whatever
    weights p: a1 = 2 tanh(p1), a2 = |a1| - 1 + (2 - |a1|) (1 + tanh(p2)) / 2. The numerator is (1 + a1 + a2) times its
    weights, whose sum thus is the gain at rest: those of slow poles would be far smaller than a step of Adam.
    """

    def __init__(self, channels: int, sections: int, radii: tuple[float, float], angle: float) -> None:
        super().__init__()
        low, high = radii
        size = low + (high - low) * torch.rand(sections, channels)
        a1, a2 = -2 * size * torch.cos(angle * torch.rand(sections, channels)), size**2
        inside = 2 * (a2 + 1 - a1.abs()) / (2 - a1.abs()) - 1
        self.weight_den = nn.Parameter(torch.atanh(torch.stack((a1 / 2, inside), 1)))
        num = torch.randn(sections, 3, channels) * 0.1
        num[:, 0] += 1
        self.weight_num = nn.Parameter(num)

    def sections(self) -> list[tuple[Float[Tensor, "3 C"], Float[Tensor, "2 C"]]]:
        """Give b0, b1, b2 and a1, a2 of each section."""
        p1, p2 = torch.tanh(self.weight_den).unbind(1)
        a1 = 2 * p1
        a2 = a1.abs() - 1 + (2 - a1.abs()) * (1 + p2) / 2
        num = (1 + a1 + a2)[:, None] * self.weight_num
        return list(zip(num, torch.stack((a1, a2), 1), strict=True))

    def over(self, x: Float[Tensor, "B T C"]) -> Float[Tensor, "B T C"]:
        """Filter a sequence from rest."""
        for num, den in self.sections():
            x = _Section.apply(x, num, den) if x.device.type == "cpu" else _doubled(x, num, den)
        return x


def _doubled(x: Float[Tensor, "B T C"], num: Float[Tensor, "3 C"], den: Float[Tensor, "2 C"]) -> Float[Tensor, "B T C"]:
    """Filter by one section with `scan`: the state is [y(k), y(k-1)]."""
    before = nn.functional.pad(x, (0, 0, 2, 0))
    v = num[0] * x + num[1] * before[:, 1:-1] + num[2] * before[:, :-2]
    shift = torch.tensor([1.0, 0.0], dtype=x.dtype, device=x.device).expand(x.shape[2], 2)
    a = torch.stack((-den.t(), shift), 1)  # [C, 2, 2]
    return scan(torch.stack((v, torch.zeros_like(v)), 3), a)[..., 0]
