"""A trained network as an ONNX graph that simulates like `Network.simulate`; the layers in single precision."""

from __future__ import annotations

import copy
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import torch

from simgap.neural.training import attention_exports
from simgap.neural.training.attention import Attending
from simgap.neural.training.blocks import Headed, Parallel, Pooled, Recurrences, Tcn
from simgap.neural.training.convolution import Convolution, Residual
from simgap.neural.training.linear_blocks import Entry, Filtered, Lru, Stacked, Static
from simgap.neural.training.recurrent import Gru, Lstm, Srnn
from simgap.neural.training.state_space import StateSpace
from simgap.records import UnusableInput

OPSET = 17
# Operator of ONNX, its order of the gates of PyTorch, and what else it must be told.
RECURRENT: dict[type, tuple[str, tuple[int, ...], dict[str, int]]] = {
    Srnn: ("RNN", (0,), {}), Gru: ("GRU", (1, 0, 2), {"linear_before_reset": 1}), Lstm: ("LSTM", (0, 3, 1, 2), {}),
}  # fmt: skip


class _Graph:
    """Nodes and constants of a network, as they are added; an array is known by its name."""

    def __init__(self, net: Any) -> None:
        self.net = net
        self.nodes: list[Any] = []
        self.constants: list[Any] = []
        self.names = 0

    def constant(self, value: Any) -> str:
        from onnx import numpy_helper

        self.constants.append(numpy_helper.from_array(np.ascontiguousarray(value), f"c{len(self.constants)}"))
        return str(self.constants[-1].name)

    def weight(self, tensor: Any) -> str:
        return self.constant(tensor.detach().cpu().float().numpy())

    def add(self, operator: str, *inputs: str, **attributes: Any) -> str:
        from onnx import helper

        self.names += 1
        name = f"v{self.names}"
        self.nodes.append(helper.make_node(operator, list(inputs), [name], **attributes))
        return name

    def whole(self, *values: int) -> str:
        return self.constant(np.array(values, dtype=np.int64))

    def block(self, block: Any, x: str) -> str:
        """Add a block over x [B, T, F]."""
        match block:
            case Headed():
                return self.dense(block.head, self.block(block.body, x))
            case Recurrences():
                for layer in block.layers:
                    x = self.recurrence(layer, x)
                return x
            case Pooled():
                for part, dilation in ((block.first, 1), (block.second, 2)):
                    x = self.convolution(part, x, dilation)
                    before = self.add("Pad", x, self.whole(0, dilation, 0, 0, -dilation, 0))
                    x = self.add("Mul", self.add("Add", x, before), self.constant(np.float32(0.5)))
                return self.convolution(block.full, x, 4)
            case Tcn():
                for level, part in enumerate(block.blocks):
                    x = self.residual(part, x, 2**level)
                return x
            case Parallel():
                z = self.add("Concat", *(self.block(branch, x) for branch in block.blocks), axis=2)
                narrow = self.add("Relu", self.dense(block.narrow, z))
                return self.add("Add", z, self.dense(block.wide, narrow))
        return self.part(block, x)

    def part(self, block: Any, x: str) -> str:
        """Add a block that the networks of the paper do not have."""
        if isinstance(block, Stacked):
            for part in block.blocks:
                x = self.block(part, x)
            return x
        adders: dict[type, Callable[[Any, str], str]] = {
            Entry: self.entry, Static: self.static, Lru: self.lru, Filtered: self.filtered,
            StateSpace: self.state_space, Attending: partial(attention_exports.add, self),
        }  # fmt: skip
        for kind, add in adders.items():
            if isinstance(block, kind):
                return add(block, x)
        raise UnusableInput(f"the network has a part, {type(block).__name__}, that has no graph")

    def static(self, block: Static, x: str) -> str:
        inner = self.add("Tanh", self.dense(block.inner, x))
        return self.add("Add", x, self.dense(block.outer, inner))

    def dense(self, layer: Any, x: str) -> str:
        return self.add("Add", self.add("MatMul", x, self.weight(layer.weight.t())), self.weight(layer.bias))

    def normed(self, layer: Any, x: str) -> str:
        return self.add("LayerNormalization", x, self.weight(layer.weight), self.weight(layer.bias), epsilon=layer.eps)

    def recurrence(self, layer: Any, x: str) -> str:
        operator, order, attributes = RECURRENT[type(layer)]

        def gates(tensor: Any) -> np.ndarray:
            parts = np.split(tensor.detach().cpu().float().numpy(), len(order))
            return np.concatenate([parts[i] for i in order])

        w, u = (self.constant(gates(tensor)[None]) for tensor in (layer.weight_ih_l0, layer.weight_hh_l0))
        offsets = np.concatenate([gates(layer.bias_ih_l0), gates(layer.bias_hh_l0)])[None]
        x = self.add("Transpose", x, perm=[1, 0, 2])
        h = self.add(operator, x, w, u, self.constant(offsets), hidden_size=layer.hidden_size, **attributes)
        return self.add("Transpose", self.add("Squeeze", h, self.whole(1)), perm=[1, 0, 2])  # from [T, 1, B, H]

    def convolution(self, layer: Convolution, x: str, dilation: int) -> str:
        before = (layer.kernel_size[0] - 1) * dilation
        x = self.add("Transpose", x, perm=[0, 2, 1])
        weights = self.weight(layer.weight), self.weight(layer.bias)
        x = self.add("Conv", x, *weights, pads=[before, 0], dilations=[dilation])
        return self.add("Transpose", self.add("Relu", x), perm=[0, 2, 1])

    def residual(self, part: Residual, x: str, dilation: int) -> str:
        inner = self.convolution(part.two, self.convolution(part.one, x, dilation), dilation)
        around = x if part.through is None else self.dense(part.through, x)
        return self.add("Relu", self.add("Add", inner, around))

    def entry(self, block: Entry, x: str) -> str:
        axis = self.whole(2)
        u = self.add("Slice", x, self.whole(0), self.whole(block.gated), axis)
        measured = self.add("Slice", x, self.whole(-1), self.whole(2**31), axis)
        return self.dense(block.full, self.add("Concat", x, self.add("Mul", u, measured), axis=2))

    def recursion(self, v: str, a: Any) -> str:
        """Add s(k) = A s(k-1) + v(k) from zero, v and s [B, T, S]; in double precision, as poles may be close to 1."""
        from onnx import TensorProto, helper

        v, name = self.add("Cast", v, to=TensorProto.DOUBLE), f"s{len(self.nodes)}"
        shape = ["B", len(a)]
        carried, now, new, out = (
            helper.make_tensor_value_info(f"{name}_{part}", TensorProto.DOUBLE, shape)
            for part in ("carried", "now", "new", "out")
        )
        moved = helper.make_node("MatMul", [carried.name, self.constant(a.T)], [f"{name}_moved"])
        added = helper.make_node("Add", [moved.output[0], now.name], [new.name])
        kept = helper.make_node("Identity", [new.name], [out.name])
        body = helper.make_graph([moved, added, kept], f"{name}_body", [carried, now], [new, out])
        first = self.add("Slice", v, self.whole(0), self.whole(1), self.whole(1))
        zero = self.add("Mul", self.add("Squeeze", first, self.whole(1)), self.constant(np.float64(0)))
        self.nodes.append(
            helper.make_node("Scan", [zero, v], [f"{name}_last", name], body=body, num_scan_inputs=1,
                             scan_input_axes=[1], scan_output_axes=[1])
        )  # fmt: skip
        return self.add("Cast", name, to=TensorProto.FLOAT)

    def lru(self, block: Lru, x: str) -> str:
        layer = block.recurrence
        re, im = (np.diag(part.detach().cpu().double().numpy()) for part in layer.poles())
        v = self.add("MatMul", x, self.weight(layer.entry().t()))
        s = self.recursion(v, np.block([[re, -im], [im, re]]))
        through = self.add("Mul", x, self.weight(layer.through))
        y = self.add("Add", self.add("MatMul", s, self.weight(layer.weight_out.t())), through)
        opening = self.add("Sigmoid", self.dense(block.gate, y))
        return self.add("Add", x, self.add("Mul", self.dense(block.value, y), opening))

    def filtered(self, block: Filtered, x: str) -> str:
        """y(k) = b0 x(k) + s1(k-1), s1(k) = b1 x(k) - a1 y(k) + s2(k-1), s2(k) = b2 x(k) - a2 y(k), s2 behind s1."""
        for num, den in block.filters.sections():
            (b0, b1, b2), (a1, a2) = (part.detach().cpu().double().numpy() for part in (num, den))
            n = len(b0)
            a = np.block([[np.diag(-a1), np.eye(n)], [np.diag(-a2), np.zeros((n, n))]])
            entry = np.concatenate((np.diag(b1 - a1 * b0), np.diag(b2 - a2 * b0)), axis=1)
            s = self.recursion(self.add("MatMul", x, self.constant(entry.astype(np.float32))), a)
            before = self.add("Pad", s, self.whole(0, 1, 0, 0, -1, -n))
            x = self.add("Add", self.add("Mul", x, self.constant(b0.astype(np.float32))), before)
        return x

    def bent(self, x: str, linear: Any, inner: Any, outer: Any) -> str:
        """Add W x + b + V tanh(U x + c) + d of the pairs (W, b), (U, c) and (V, d), in double precision."""

        def affine(x: str, weight: Any, bias: Any) -> str:
            w, b = (self.constant(value.detach().cpu().double().numpy()) for value in (weight.t(), bias))
            return self.add("Add", self.add("MatMul", x, w), b)

        return self.add("Add", affine(x, *linear), affine(self.add("Tanh", affine(x, *inner)), *outer))

    def state_space(self, block: StateSpace, x: str) -> str:
        """Scan over the samples in double precision; the state is carried, and the samples that the encoder reads."""
        from onnx import TensorProto, helper

        double, last = TensorProto.DOUBLE, self.whole(-1)
        n, encoder, zero = block.size, block.encoder, torch.zeros(block.size)
        inputs = block.nu if encoder is None else encoder.linear.in_features // encoder.past
        past = 1 if encoder is None else encoder.past
        x = self.add("Cast", x, to=double)
        first = self.add("Squeeze", self.add("Slice", x, self.whole(0), self.whole(1), self.whole(1)), self.whole(1))
        starts = [self.add("MatMul", first, self.constant(np.zeros((inputs, size)))) for size in (n, past * inputs)]
        around, self.nodes = self.nodes, []
        s, rows, now = (f"{first}_{name}" for name in ("state", "rows", "now"))
        u = self.add("Slice", now, self.whole(0), self.whole(block.nu), last)
        new = self.add("Concat", self.add("Slice", rows, self.whole(inputs), self.whole(2**31), last), now, axis=1)
        both = self.add("Concat", s, u, axis=1)
        inner = block.inner.weight, block.inner.bias
        moved = self.bent(both, (block.linear(), zero), inner, (block.weight_out, zero))
        if encoder is not None:
            layers = [(layer.weight, layer.bias) for layer in (encoder.inner, encoder.outer)]
            found = self.bent(new, (encoder.weight(), encoder.linear.bias), *layers)
            mark = self.add("Slice", now, last, self.whole(2**31), last)
            moved = self.add("Add", moved, self.add("Mul", mark, self.add("Sub", found, moved)))
        taken = [(s, n), (rows, past * inputs), (now, inputs)]
        given = [(moved, n), (new, past * inputs), (self.add("Identity", both), n + block.nu)]
        described = [
            [helper.make_tensor_value_info(name, double, ["B", size]) for name, size in part] for part in (taken, given)
        ]
        body = helper.make_graph(self.nodes, f"{first}_body", described[0], described[1])
        self.nodes = around
        outputs = [f"{first}_{name}" for name in ("last_state", "last_rows", "states")]
        self.nodes.append(
            helper.make_node("Scan", [*starts, x], outputs, body=body, num_scan_inputs=1, scan_input_axes=[1],
                             scan_output_axes=[1])
        )  # fmt: skip
        features = self.add("Cast", outputs[2], to=TensorProto.FLOAT)
        shown = block.integrated or n + block.nu
        return self.add("Slice", features, self.whole(0), self.whole(shown), self.whole(2))

    def scaled(self, x: str, scaling: Any) -> str:
        shifted = self.add("Sub", x, self.constant(np.array(scaling.middle)))
        return self.add("Cast", self.add("Div", shifted, self.constant(np.array(scaling.half))), to=1)

    def stateful(self, model: Any) -> str:
        """Read n measured samples, then run free."""
        samples = self.add("Shape", "u", start=1, end=2)
        n = self.add("Shape", "y_init", start=1, end=2)
        y = self.scaled("y_init", model.of_y)
        ones = self.add("Pad", y, self.whole(0, 0, 0, 0, 0, 1), self.constant(np.float32(1)))  # y, and 1 behind it
        free = self.add("Sub", samples, n)
        pads = self.add("Concat", self.whole(0, 0, 0, 0), free, self.whole(0), axis=0)
        features = self.add("Concat", self.scaled("u", model.of_x), self.add("Pad", ones, pads), axis=2)
        return self.add("Slice", self.block(self.net, features), n, samples, self.whole(1))

    def windowed(self, model: Any) -> str:
        """Take the window before each sample; before the record its inputs stood still."""
        if model.window % 4 and any(isinstance(part, Pooled) for part in model.trained.modules()):
            raise UnusableInput(f"a window of {model.window} samples is no multiple of four, as a pooled one must be")
        window, inputs, zero, one = model.window, model.inputs, self.whole(0), self.whole(1)
        shape = self.add("Shape", "u", start=0, end=2)  # [B, T]
        n = self.add("Shape", "y_init", start=1, end=2)
        samples = self.add("Slice", shape, one, self.whole(2), zero)
        scalar = [self.add("Squeeze", value, zero) for value in (n, samples)]
        numbers = self.add("Range", self.constant(np.int64(0)), scalar[1], self.constant(np.int64(1)))
        t = self.add("Mul", self.add("Cast", numbers, to=11), self.constant(np.float64(model.dt)))
        t = self.add("Expand", self.add("Unsqueeze", t, self.whole(0, 2)), self.add("Concat", shape, one, axis=0))
        x = self.scaled(self.add("Concat", t, "u", axis=2), model.of_x)
        first = self.add("Slice", x, zero, one, one)
        padded = self.add("Concat", *[first] * window, x, axis=1)
        rows = self.add("Unsqueeze", self.add("Range", *scalar, self.constant(np.int64(1))), one)  # [N, 1]
        which = self.add("Add", rows, self.constant(np.arange(window, dtype=np.int64)[None]))
        views = self.add("Reshape", self.add("Gather", padded, which, axis=1), self.whole(-1, window, inputs))
        y = self.add("Gather", self.block(self.net, views), self.constant(np.int64(window - 1)), axis=1)
        free = self.add("Sub", samples, n)
        batch = self.add("Slice", shape, zero, one, zero)
        outputs = self.whole(len(model.of_y.middle))
        return self.add("Reshape", y, self.add("Concat", batch, free, outputs, axis=0))


def build(model: Any) -> Any:
    """Build u [B, T, nu], y_init [B, n, ny] -> y_hat [B, T-n, ny], in physical units and double precision."""
    import onnx
    from onnx import TensorProto, helper

    graph, ny = _Graph(copy.deepcopy(model.trained).double()), len(model.of_y.middle)
    nu = len(model.of_x.middle) - model.windowed
    y = graph.windowed(model) if model.windowed else graph.stateful(model)
    half, middle = graph.constant(np.array(model.of_y.half)), graph.constant(np.array(model.of_y.middle))
    y = graph.add("Add", graph.add("Mul", graph.add("Cast", y, to=TensorProto.DOUBLE), half), middle)
    graph.nodes.append(helper.make_node("Identity", [y], ["y_hat"]))

    def value(name: str, *shape: Any) -> Any:
        return helper.make_tensor_value_info(name, TensorProto.DOUBLE, shape)

    made = helper.make_model(
        helper.make_graph(
            graph.nodes, "simulate", [value("u", "B", "T", nu), value("y_init", "B", "n", ny)],
            [value("y_hat", "B", "N", ny)], graph.constants,
        ),
        opset_imports=[helper.make_opsetid("", OPSET)], ir_version=8,
    )  # fmt: skip
    onnx.checker.check_model(made, full_check=True)
    return made
