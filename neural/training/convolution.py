"""A causal convolution over time with ReLU, whose pass on the CPU is compiled like that of the recurrent layers."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from simgap.neural.training import convolution_kernels

kernels: Any = convolution_kernels  # compiled, and so are the checks of their arguments


class _Pass(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, x: Tensor, weight: Tensor, offset: Tensor, dilation: int, step: int) -> Tensor:
        values, w = x.detach().numpy(), weight.detach().numpy()
        y = np.empty((len(values), -(-values.shape[1] // step), len(w)), values.dtype)
        kernels.run_conv(values, w, offset.detach().numpy(), dilation, step, y)
        ctx.rest = values, w, y, dilation, step
        return torch.from_numpy(y)

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor | None, ...]:
        x, w, y, dilation, step = ctx.rest
        dw, d_offset, dx = np.empty_like(w), np.empty(len(w), y.dtype), _like(x, ctx.needs_input_grad[0])
        kernels.back_conv(x, w, y, grads[0].contiguous().numpy(), dilation, step, dw, d_offset, dx)
        return _tensor(dx), torch.from_numpy(dw), torch.from_numpy(d_offset), None, None


class _Pooled(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, x: Tensor, *weights: Tensor) -> Tensor:
        arrays = [value.detach().numpy() for value in weights]
        values = x.detach().numpy()
        batch, steps, _ = values.shape
        outputs = [len(w) for w in arrays[::2]]
        sizes = ((steps, outputs[0]), (steps // 2, outputs[0]), (steps // 2, outputs[1]), (steps // 4, outputs[1]),
                 (1, outputs[2]))  # fmt: skip
        activations = [np.empty((batch, *size), values.dtype) for size in sizes]
        kernels.run_pooled(values, *arrays, *activations)
        ctx.rest = values, arrays, activations
        return torch.from_numpy(activations[-1])

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor | None, ...]:
        x, arrays, activations = ctx.rest
        gradients = [np.empty_like(value) for value in arrays]
        dx = _like(x, ctx.needs_input_grad[0])
        kernels.back_pooled(x, *arrays[::2], *activations, grads[0].contiguous().numpy(), *gradients, dx)
        return (_tensor(dx), *map(torch.from_numpy, gradients))


class _Residual(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, x: Tensor, step: int, dilation: int, *weights: Tensor) -> Tensor:
        arrays = [value.detach().numpy() for value in weights]
        values = x.detach().numpy()
        batch, length, channels = values.shape
        outputs, answers = len(arrays[0]), -(-length // step)
        sizes = (length, outputs), (answers, outputs), (answers, channels), (answers, outputs)
        activations = [np.empty((batch, *size), values.dtype) for size in sizes]
        kernels.run_block(values, step, *arrays, dilation, *activations)
        ctx.rest = values, arrays, activations, step, dilation
        return torch.from_numpy(activations[-1])

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor | None, ...]:
        x, arrays, activations, step, dilation = ctx.rest
        w1, _, w2, _, skip, _ = arrays
        gradients = [np.empty_like(value) for value in arrays]
        dx = _like(x, ctx.needs_input_grad[0])
        kernels.back_block(x, step, w1, w2, skip, dilation, *activations, grads[0].contiguous().numpy(), *gradients, dx)
        return (_tensor(dx), None, None, *map(torch.from_numpy, gradients))


def _like(x: np.ndarray, wanted: bool) -> np.ndarray:
    """Allocate the gradient of x; without samples if nobody wants it."""
    return np.empty_like(x if wanted else x[:, :0])


def _tensor(dx: np.ndarray) -> Tensor | None:
    return torch.from_numpy(dx) if dx.shape[1] else None


class Residual(nn.Module):
    """y = ReLU(F(x) + x), F = conv - ReLU - dropout - conv - ReLU - dropout (Bai, Kolter and Koltun 2018).

    Where the number of channels changes, x passes through a 1 x 1 convolution around F.
    """

    def __init__(self, inputs: int, channels: int, kernel: int, dropout: float) -> None:
        super().__init__()
        self.one, self.two = Convolution(inputs, channels, kernel), Convolution(channels, channels, kernel)
        self.through = None if inputs == channels else full(inputs, channels)
        self.dropout = nn.Dropout(dropout)

    def over(self, x: Float[Tensor, "B T F"], dilation: int = 1, step: int = 1) -> Float[Tensor, "B S G"]:
        """Run the block over a sequence, at every `step`-th sample counted from the end."""
        if x.device.type == "cpu" and not (self.training and self.dropout.p):
            weights = [self.one.weight, self.one.bias, self.two.weight, self.two.bias]
            if self.through is None:
                weights += [x.new_empty(0, 0), x.new_empty(0)]
            else:
                weights += [self.through.weight, self.through.bias]
            return _Residual.apply(x.contiguous(), step, dilation, *weights)  # type: ignore[no-any-return]
        inner = self.dropout(self.one.over(x, dilation))
        inner = self.dropout(self.two.over(inner, dilation, step))
        x = x[:, (x.shape[1] - 1) % step :: step]
        return torch.relu(inner + (x if self.through is None else self.through(x)))


def full(inputs: int, outputs: int) -> nn.Linear:
    """Make a fully connected layer with the initial weights of Keras: Glorot uniform, offsets zero."""
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

    def over(self, x: Float[Tensor, "B T F"], dilation: int = 1, step: int = 1) -> Float[Tensor, "B S G"]:
        """Convolve a sequence, at every `step`-th sample counted from the end."""
        if x.device.type == "cpu":
            return _Pass.apply(x.contiguous(), self.weight, self.bias, dilation, step)  # type: ignore[no-any-return]
        padded = nn.functional.pad(x.transpose(1, 2), ((self.kernel_size[0] - 1) * dilation, 0))
        y = torch.relu(nn.functional.conv1d(padded, self.weight, self.bias, dilation=dilation)).transpose(1, 2)
        return y[:, (x.shape[1] - 1) % step :: step]


def pooled(
    x: Float[Tensor, "B T F"], first: Convolution, second: Convolution, last: Convolution
) -> Float[Tensor, "B G"]:
    """Convolve twice, each time averaging pairs of samples, then a third time at the last sample.

    The length has to be a multiple of four.
    """
    if x.device.type == "cpu":
        weights = [value for part in (first, second, last) for value in (part.weight, part.bias)]
        return _Pooled.apply(x.contiguous(), *weights)[:, 0]  # type: ignore[no-any-return]
    for part in (first, second):
        x = part.over(x).unflatten(1, (-1, 2)).mean(2)
    return last.over(x, step=x.shape[1])[:, 0]
