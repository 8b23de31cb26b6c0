"""A causal convolution over time with ReLU, whose pass on the CPU is compiled like that of the recurrent layers."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from simgap.neural.training import convolution_kernels as kernels


class _Pass(torch.autograd.Function):
    """A dilated convolution, or one with pooling (dilation 0)."""

    @staticmethod
    def forward(ctx: Any, x: Tensor, weight: Tensor, offset: Tensor, dilation: int) -> Tensor:
        values, w = x.detach().numpy(), weight.detach().numpy()
        batch, steps, channels = values.shape
        columns = np.empty((batch * steps, channels * w.shape[2]), values.dtype)
        y = np.empty((batch, steps, len(w)), values.dtype)
        ctx.rest = w, columns, y, dilation, values.shape
        if dilation:
            kernels.run_conv(values, w, offset.detach().numpy(), dilation, columns, y)
            return torch.from_numpy(y)
        mean = np.empty((batch, steps // 2, len(w)), values.dtype)
        kernels.run_pooled(values, w, offset.detach().numpy(), columns, y, mean)
        return torch.from_numpy(mean)

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor | None, ...]:
        w, columns, y, dilation, (batch, steps, channels) = ctx.rest
        wanted = ctx.needs_input_grad[0]
        dw, d_offset = np.empty_like(w), np.empty(len(w), y.dtype)
        dx = np.empty((batch, steps if wanted else 0, channels), y.dtype)
        dy = grads[0].contiguous().numpy()
        if dilation:
            kernels.back_conv(w, columns, y, dy, dilation, dw, d_offset, dx)
        else:
            kernels.back_pooled(w, columns, y, dy, dw, d_offset, dx)
        return torch.from_numpy(dx) if wanted else None, torch.from_numpy(dw), torch.from_numpy(d_offset), None


class _Residual(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, x: Tensor, step: int, dilation: int, *weights: Tensor) -> Tensor:
        given = [value.detach().numpy() for value in weights]
        values = x.detach().numpy()
        batch, length, channels = values.shape
        outputs, _, taps = given[0].shape
        steps = -(-length // step)
        sizes = (channels, channels * taps, outputs, outputs * taps, outputs, outputs)
        kept, columns1, y1, columns2, y2, y = held = [np.empty((batch, steps, size), values.dtype) for size in sizes]
        flat = [columns.reshape(batch * steps, -1) for columns in (columns1, columns2)]
        kernels.run_block(values, step, *given, dilation, kept, flat[0], y1, flat[1], y2, y)
        ctx.rest = given, held, step, dilation, length
        return torch.from_numpy(y)

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor | None, ...]:
        (w1, o1, w2, o2, skip, skip_offset), (kept, columns1, y1, columns2, y2, y), step, dilation, length = ctx.rest
        batch, steps, channels = kept.shape
        wanted = ctx.needs_input_grad[0]
        found = [np.empty_like(value) for value in (w1, o1, w2, o2, skip, skip_offset)]
        dx = np.empty((batch, length if wanted else 0, channels), y.dtype)
        flat = [columns.reshape(batch * steps, -1) for columns in (columns1, columns2)]
        dy = grads[0].contiguous().numpy()
        kernels.back_block(step, w1, w2, skip, dilation, kept, flat[0], y1, flat[1], y2, y, dy, *found, dx)
        return (torch.from_numpy(dx) if wanted else None, None, None, *map(torch.from_numpy, found))


class Residual(nn.Module):
    """y = ReLU(F(x) + x), F = conv - ReLU - dropout - conv - ReLU - dropout (Bai, Kolter and Koltun 2018).

    Where the number of channels changes, x passes through a 1 x 1 convolution around F. `over` may look at every
    `step`-th sample only, counted from the end.
    """

    def __init__(self, inputs: int, channels: int, kernel: int, dropout: float) -> None:
        super().__init__()
        self.one, self.two = Convolution(inputs, channels, kernel), Convolution(channels, channels, kernel)
        self.through = None if inputs == channels else full(inputs, channels)
        self.dropout = nn.Dropout(dropout)

    def over(self, x: Float[Tensor, "B T F"], dilation: int = 1, step: int = 1) -> Float[Tensor, "B S G"]:
        """The block over a sequence."""
        if x.device.type == "cpu" and not (self.training and self.dropout.p):
            weights = [self.one.weight, self.one.bias, self.two.weight, self.two.bias]
            if self.through is None:
                weights += [x.new_empty(0, 0), x.new_empty(0)]
            else:
                weights += [self.through.weight, self.through.bias]
            return _Residual.apply(x.contiguous(), step, dilation, *weights)  # type: ignore[no-any-return]
        x = x[:, (x.shape[1] - 1) % step :: step]
        inner = x
        for convolution in (self.one, self.two):
            inner = self.dropout(convolution.over(inner, dilation))
        return torch.relu(inner + (x if self.through is None else self.through(x)))


def full(inputs: int, outputs: int) -> nn.Linear:
    """A fully connected layer with the initial weights of Keras: Glorot uniform, offsets zero."""
    layer = nn.Linear(inputs, outputs)
    nn.init.xavier_uniform_(layer.weight)
    nn.init.zeros_(layer.bias)
    return layer


class Convolution(nn.Conv1d):
    """y(k) = ReLU(b + sum over j < K of W_j x(k - j dilation)), with zeros before the start; weights as in PyTorch."""

    def __init__(self, inputs: int, outputs: int, kernel: int) -> None:
        super().__init__(inputs, outputs, kernel)
        nn.init.xavier_uniform_(self.weight)
        assert self.bias is not None
        nn.init.zeros_(self.bias)

    def over(self, x: Float[Tensor, "B T F"], dilation: int = 1) -> Float[Tensor, "B T G"]:
        """The convolution of a sequence."""
        if x.device.type == "cpu":
            return _Pass.apply(x.contiguous(), self.weight, self.bias, dilation)  # type: ignore[no-any-return]
        padded = nn.functional.pad(x.transpose(1, 2), ((self.kernel_size[0] - 1) * dilation, 0))
        return torch.relu(nn.functional.conv1d(padded, self.weight, self.bias, dilation=dilation)).transpose(1, 2)

    def pooled(self, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B S G"]:
        """The means of each two samples of the convolution of a sequence of even length."""
        if x.device.type == "cpu":
            return _Pass.apply(x.contiguous(), self.weight, self.bias, 0)  # type: ignore[no-any-return]
        return self.over(x).unflatten(1, (-1, 2)).mean(2)
