"""The recurrent layers of PyTorch, with a pass through time of our own on the CPU.

PyTorch records every small operation of every sample there, which takes longer than the operations themselves. Here
the pass and its derivative are one compiled loop each, and the gradients of the weights one product over all samples.
PyTorch's LSTM is one compiled loop, too; two narrow layers, as in the encoder, still take it 1.5 times as long as ours
(tests/speed/bench_torch.py).
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from simgap.neural.training import recurrent_kernels

kernels: Any = recurrent_kernels  # compiled, and so are the checks of their arguments

Weights = tuple[Tensor, Tensor, Tensor, Tensor]
Net = TypeVar("Net", bound=nn.RNNBase)


class _Pass(torch.autograd.Function):
    """x [T, F, B] and PyTorch's four weights to the states [T, H, B], or to [1, H, B], those at the end."""

    @staticmethod
    def forward(ctx: Any, x: Tensor, w: Tensor, u: Tensor, b: Tensor, c: Tensor, kind: str, only_last: bool) -> Tensor:
        units = u.shape[1]
        arrays = [value.detach().numpy() for value in (x, w, u, b, c)]
        h, gates, inner = (np.empty((len(x), rows, x.shape[2]), arrays[0].dtype) for rows in (units, len(u), units))
        if kind == "rnn":
            kernels.run_rnn(*arrays[:3], arrays[3] + arrays[4], h)
        elif kind == "gru":
            kernels.run_gru(*arrays, h, gates, inner)
        else:
            kernels.run_lstm(*arrays[:3], arrays[3] + arrays[4], h, gates, inner)
        ctx.save_for_backward(x, w, u)
        ctx.rest = kind, only_last, h, gates, inner
        return torch.from_numpy(h[-1:] if only_last else h)

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor | None, ...]:
        x, w, u = ctx.saved_tensors
        kind, only_last, h, gates, inner = ctx.rest
        steps, units, batch = h.shape
        dh = grads[0].contiguous().numpy()
        if only_last:
            dh = np.broadcast_to(dh, h.shape)
        ut = np.ascontiguousarray(u.detach().numpy().T)
        d = np.empty((len(u), steps, batch), h.dtype)
        d_inner = d
        if kind == "rnn":
            kernels.back_rnn(ut, h, dh, only_last, d)
        elif kind == "gru":
            of_new = np.empty((units, steps, batch), h.dtype)
            kernels.back_gru(ut, h, gates, inner, dh, only_last, d, of_new)
            d_inner = np.concatenate((d[: 2 * units], of_new))
        else:
            kernels.back_lstm(ut, gates, inner, dh, only_last, d)
        flat, flat_inner = (torch.from_numpy(part.reshape(len(u), -1)) for part in (d, d_inner))  # [G H, T B]
        before = np.zeros((steps, batch, units), h.dtype)
        before[1:] = h[:-1].transpose(0, 2, 1)
        dw = (x.transpose(0, 1).reshape(-1, steps * batch) @ flat.t()).t()
        du = flat_inner @ torch.from_numpy(before.reshape(steps * batch, units))
        dx = (w.t() @ flat).view(-1, steps, batch).transpose(0, 1) if ctx.needs_input_grad[0] else None
        return dx, dw, du, flat.sum(1), flat_inner.sum(1), None, None


class Layer(nn.Module):
    """A recurrent layer of PyTorch with one level and the batch first, from the state zero."""

    def states(self: Any, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B T H"]:
        """Give the states at all samples."""
        return self(x)[0] if x.device.type != "cpu" else self._pass(x, False).permute(2, 0, 1)

    def last(self: Any, x: Float[Tensor, "B T F"]) -> Float[Tensor, "B H"]:
        """Give the state at the last sample."""
        return self(x)[0][:, -1] if x.device.type != "cpu" else self._pass(x, True)[0].t()

    def _pass(self: Any, x: Tensor, only_last: bool) -> Tensor:
        weights = (self.weight_ih_l0, self.weight_hh_l0, self.bias_ih_l0, self.bias_hh_l0)
        return _Pass.apply(x.permute(1, 2, 0).contiguous(), *weights, self.kind, only_last)


class Srnn(Layer, nn.RNN):
    """Simple recurrent layer (Elman 1990): h(k) = tanh(W x(k) + U h(k-1) + b)."""

    kind = "rnn"


class Gru(Layer, nn.GRU):
    """Gated recurrent unit (Cho 2014) that resets after the product, as in cuDNN and Keras."""

    kind = "gru"


class Lstm(Layer, nn.LSTM):
    """Long short-term memory (Hochreiter and Schmidhuber 1997, with the forget gate of Gers 2000)."""

    kind = "lstm"


def recurrent(layer: type[Net], inputs: int, units: int) -> Net:
    """Make a layer with the initial weights of Keras.

    Glorot uniform from the input, orthogonal from the state with all gates together, offsets zero but that of a
    forget gate, which is one.
    """
    net: Any = layer(inputs, units, batch_first=True)  # type: ignore[call-arg]  # RNNBase asks for its kind
    nn.init.xavier_uniform_(net.weight_ih_l0)
    nn.init.orthogonal_(net.weight_hh_l0)
    nn.init.zeros_(net.bias_ih_l0)
    nn.init.zeros_(net.bias_hh_l0)
    if layer is Lstm:
        net.bias_ih_l0.data[units : 2 * units] = 1.0
    return net
