"""A causal convolution over time with ReLU, whose pass on the CPU is compiled like that of the recurrent layers."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from simgap.neural.training import convolution_kernels as kernels


class _Pass(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, x: Tensor, weight: Tensor, offset: Tensor, dilation: int) -> Tensor:
        values, w = x.detach().numpy(), weight.detach().numpy()
        batch, steps, _ = values.shape
        flat = np.ascontiguousarray(w.transpose(2, 1, 0).reshape(-1, len(w)))  # [K C, G]
        columns = np.empty((batch * steps, len(flat)), values.dtype)
        y = np.empty((batch, steps, len(w)), values.dtype)
        kernels.run_conv(values, flat, offset.detach().numpy(), dilation, columns, y)
        ctx.rest = values.shape, flat, columns, y, dilation, w.shape
        return torch.from_numpy(y)

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor | None, ...]:
        (batch, steps, channels), flat, columns, y, dilation, of_weight = ctx.rest
        dy = grads[0].contiguous().numpy()
        wanted = ctx.needs_input_grad[0]
        d, d_offset = np.empty((len(columns), y.shape[2]), y.dtype), np.empty(y.shape[2], y.dtype)
        d_columns = np.empty(columns.shape if wanted else (0, 0), y.dtype)
        dx = np.empty((batch, steps if wanted else 0, channels), y.dtype)
        kernels.back_conv(np.ascontiguousarray(flat.T), y, dy, dilation, d, d_offset, d_columns, dx)
        dw = (columns.T @ d).reshape(of_weight[::-1]).transpose(2, 1, 0)
        dw = torch.from_numpy(np.ascontiguousarray(dw))
        return torch.from_numpy(dx) if wanted else None, dw, torch.from_numpy(d_offset), None


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
