"""Neural state spaces: an encoder finds the state in measured samples, a network takes it from sample to sample."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from simgap.neural.training import state_space_kernels
from simgap.neural.training.blocks import Block
from simgap.neural.training.convolution import full

kernels: Any = state_space_kernels  # compiled, and so are the checks of their arguments

RADII, ANGLE = (0.4, 0.99), 1.0  # of the poles at first: a few samples to a few hundred, up to a sixth of the rate
BENT = 0.1  # size of what the network adds to a state at first, beside its linear part


class _Pass(torch.autograd.Function):
    """A, W, V, linear [T, S, B], bent [T, H, B] and s(0) [S, B] to the states [T + 1, S, B]."""

    @staticmethod
    def forward(ctx: Any, a: Tensor, w: Tensor, v: Tensor, linear: Tensor, bent: Tensor, start: Tensor) -> Tensor:
        arrays = [value.detach().contiguous().numpy() for value in (a, w, v, linear, bent)]
        s, h = np.empty((len(linear) + 1, *start.shape), arrays[0].dtype), np.empty_like(arrays[4])
        s[0] = start.detach().numpy()
        kernels.run_states(*arrays, s, h)
        ctx.rest = *arrays[:3], s, h
        return torch.from_numpy(s)

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor, ...]:
        a, w, v, s, h = ctx.rest
        ds = grads[0].clone(memory_format=torch.contiguous_format).numpy()
        d_linear, d_bent = np.empty_like(s[1:]), np.empty_like(h)
        kernels.back_states(*(np.ascontiguousarray(part.T) for part in (a, w, v)), h, ds, d_linear, d_bent)
        products = (("isb,ijb", d_linear, s[:-1]), ("isb,ijb", d_bent, s[:-1]), ("isb,ijb", d_linear, h))
        weights = [torch.einsum(f"{how}->sj", torch.from_numpy(x), torch.from_numpy(y)) for how, x, y in products]
        return *weights, *map(torch.from_numpy, (d_linear, d_bent, ds[0]))


def sample_by_sample(
    a: Tensor, w: Tensor, v: Tensor, linear: Float[Tensor, "T S B"], bent: Float[Tensor, "T H B"], start: Tensor
) -> Float[Tensor, "N S B"]:
    """Do what the compiled pass does in PyTorch's own operations."""
    states = [start]
    for of_s, of_h in zip(linear, bent, strict=True):
        states.append(a @ states[-1] + of_s + v @ torch.tanh(w @ states[-1] + of_h))
    return torch.stack(states)


class Encoder(nn.Module):
    """psi(rows) = W rows + b + V tanh(U rows + c): the state behind the last `past` measured samples, oldest first.

    Of a model whose first states are its outputs, psi says what those change by from the last measured ones on.
    """

    def __init__(self, inputs: int, at: int, states: int, hidden: int, past: int, outputs: int) -> None:
        super().__init__()
        self.past, self.outputs, self.at = past, outputs, (past - 1) * inputs + at
        self.linear = full(past * inputs, states)
        self.inner, self.outer = full(past * inputs, hidden), full(hidden, states)

    def weight(self) -> Float[Tensor, "S P"]:
        """Give W; `outputs` states begin at the outputs of the last sample, `at` among its features."""
        weight = self.linear.weight
        if not self.outputs:
            return weight
        ones = torch.eye(self.outputs, dtype=weight.dtype, device=weight.device)
        behind = weight.shape[1] - self.at - self.outputs
        return weight + nn.functional.pad(ones, (self.at, behind, 0, len(weight) - self.outputs))

    def forward(self, x: Float[Tensor, "B n F"]) -> Float[Tensor, "B n S"]:
        """Find the state behind each of n samples; before the first there are zeros."""
        rows = nn.functional.pad(x, (0, 0, self.past - 1, 0)).unfold(1, self.past, 1).transpose(2, 3).flatten(2)
        return nn.functional.linear(rows, self.weight(), self.linear.bias) + self.outer(torch.tanh(self.inner(rows)))


class StateSpace(Block):
    """s(k+1) = A s(k) + B u(k) + V tanh(W s(k) + U u(k) + c); the features of sample k are [s(k), u(k)].

    A turns and shrinks `pairs` of states, as the poles of an LRU do, and tanh is bounded: no weights make these run
    away. The last `measured` features of a sample, outputs and the mark of a measured one, are no inputs u. Behind
    samples with the mark 1 the state is what an encoder says; without any it begins at zero. So many states as are
    `integrated` come first and are the only features: the outputs, summed up from the others by rows [I, L] of A.
    """

    def __init__(self, inputs: int, measured: int, pairs: int, hidden: int, past: int, integrated: int = 0) -> None:
        super().__init__()
        self.nu, self.integrated = inputs - measured, integrated
        self.size = integrated + 2 * pairs
        low, high = RADII
        radius = torch.sqrt(torch.rand(pairs) * (high**2 - low**2) + low**2)
        self.radius = nn.Parameter(torch.log(-torch.log(radius)))
        self.angle = nn.Parameter(torch.log(ANGLE * torch.rand(pairs)))
        self.rates = nn.Parameter(BENT * torch.randn(integrated, 2 * pairs) / math.sqrt(2 * pairs))
        gain = torch.cat((torch.full((integrated,), BENT), torch.sqrt(1 - radius**2).repeat(2)))[:, None]
        self.weight_in = nn.Parameter(gain * torch.randn(self.size, self.nu) / math.sqrt(self.nu))
        self.inner = full(self.size + self.nu, hidden)
        self.weight_out = nn.Parameter(BENT * gain * torch.randn(self.size, hidden) / math.sqrt(hidden))
        self.encoder = Encoder(inputs, self.nu, self.size, hidden, past, integrated) if measured else None

    def linear(self) -> Float[Tensor, "S G"]:
        """Give [A, B]."""
        radius, angle = torch.exp(-torch.exp(self.radius)), torch.exp(self.angle)
        re, im = torch.diag(radius * torch.cos(angle)), torch.diag(radius * torch.sin(angle))
        turned = torch.cat((torch.cat((re, -im), 1), torch.cat((im, re), 1)))
        ones = torch.eye(self.integrated, dtype=turned.dtype, device=turned.device)
        outputs = torch.cat((ones, self.rates), 1)
        others = nn.functional.pad(turned, (self.integrated, 0))
        return torch.cat((torch.cat((outputs, others)), self.weight_in), 1)

    def forward(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T G"]:
        """Compute the features at all samples."""
        measured = int(x[0, :, -1].sum()) if self.encoder is not None else 0
        s = x.new_zeros(len(x), 1, self.size)
        if self.encoder is not None and measured:
            s = torch.cat((s, self.encoder(x[:, :measured])), 1)
        u = x[..., : self.nu]
        s = torch.cat((s[:, :-1], self._free(u[:, measured:-1], s[:, -1])), 1)
        return s[..., : self.integrated] if self.integrated else torch.cat((s, u), dim=2)

    def last(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B G"]:
        """Compute the features at the last sample."""
        return self.forward(x)[:, -1]

    def _free(self, u: Float[Tensor, "B T nu"], start: Float[Tensor, "B S"]) -> Float[Tensor, "B N S"]:
        """Compute s(0), .. s(T) from s(0)."""
        (a, b), (w, of_u) = (both.split((self.size, self.nu), 1) for both in (self.linear(), self.inner.weight))
        linear, bent = nn.functional.linear(u, b), nn.functional.linear(u, of_u, self.inner.bias)
        run = _Pass.apply if u.device.type == "cpu" else sample_by_sample
        s: Tensor = run(a, w, self.weight_out, linear.permute(1, 2, 0), bent.permute(1, 2, 0), start.t())
        return s.permute(2, 0, 1)
