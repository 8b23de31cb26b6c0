"""A trained network as a step form, for exports: `layers` takes the features of one sample through all of its parts."""

from __future__ import annotations

import copy
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import torch
from jaxtyping import Float

from simgap.neural.training import attention_exports, steps
from simgap.neural.training.attention import Attending
from simgap.neural.training.blocks import Headed, Parallel, Pooled, Recurrences, Tcn
from simgap.neural.training.convolution import Convolution, Residual
from simgap.neural.training.linear_blocks import Entry, Filtered, Lru, Stacked, Static
from simgap.neural.training.recurrent import Gru, Lstm, Srnn
from simgap.neural.training.scaling import features
from simgap.neural.training.state_space import Encoder, StateSpace
from simgap.records import UnusableInput
from simgap.step_form import StepForm, source_of

RECURRENT: dict[type, tuple[str, int]] = {Srnn: ("rnn", 1), Gru: ("gru", 1), Lstm: ("lstm", 2)}  # parts of a state
LAYERS = (
    steps.sigmoid, steps.weighted, steps.dense, steps.rnn, steps.gru, steps.lstm, steps.remember, steps.convolution,
    steps.mean_of_two, steps.add, steps.copy, steps.gated, steps.squash, steps.gate, steps.diagonal, steps.read_off,
    steps.section, steps.read, steps.hold, steps.normed, steps.attend,
)  # fmt: skip
STATEFUL = '''\
def step(s: list, u: list, y: list):
    """Fill y(k) from u(k), and take the state to the next sample; there is no measured output."""
    x = [0.0] * {inputs}
    for i in range({nu}):
        x[i] = (u[i] - X_MIDDLE[i]) / X_HALF[i]
    layers(s, x, y)
    for i in range({ny}):
        y[i] = y[i] * Y_HALF[i] + Y_MIDDLE[i]
'''
WINDOWED = '''\
def step(s: list, u: list, y: list):
    """Fill y(k) from the window of inputs before u(k), and append u(k) to it; s[{count}] counts samples."""
    x = [0.0] * {inputs}
    now = [0.0] * {inputs}
    now[0] = (s[{count}] * {dt!r} - X_MIDDLE[0]) / X_HALF[0]
    for i in range({nu}):
        now[1 + i] = (u[i] - X_MIDDLE[1 + i]) / X_HALF[1 + i]
    if s[{count}] == 0.0:
        for w in range({window}):
            copy(now, {inputs}, s, {buffer} + w * {inputs})
    for i in range({buffer}):
        s[i] = 0.0
    for w in range({window}):
        for i in range({inputs}):
            x[i] = s[{buffer} + w * {inputs} + i]
        layers(s, x, y)
    remember(now, {inputs}, s, {buffer}, {window})
    s[{count}] += 1.0
    for i in range({ny}):
        y[i] = y[i] * Y_HALF[i] + Y_MIDDLE[i]
'''


class _Writer:
    """Writes `layers`, and hands out arrays, constants and places in the state on the way."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.constants: dict[str, np.ndarray] = {}
        self.arrays = self.cells = 0

    def array(self, size: int) -> str:
        self.arrays += 1
        self.lines.append(f"v{self.arrays} = [0.0] * {size}")
        return f"v{self.arrays}"

    def take(self, count: int) -> int:
        self.cells += count
        return self.cells - count

    def weights(self, *tensors: Any) -> str:
        names = []
        for tensor in tensors:
            names.append(f"W{len(self.constants)}")
            self.constants[names[-1]] = tensor.detach().cpu().double().numpy().ravel()
        return ", ".join(names)

    def block(self, block: Any, x: str, nx: int) -> tuple[str, int]:
        """Write a block over the array x [nx]; return its array and size."""
        match block:
            case Headed():
                return self.dense(block.head, *self.block(block.body, x, nx))
            case Recurrences():
                for layer in block.layers:
                    x, nx = self.recurrence(layer, x, nx)
                return x, nx
            case Pooled():
                for part, dilation in ((block.first, 1), (block.second, 2)):
                    x, nx = self.convolution(part, x, nx, dilation)
                    y, at = self.array(nx), self.take((dilation + 1) * nx)
                    self.lines.append(f"mean_of_two({x}, {nx}, s, {at}, {dilation}, {y})")
                    x = y
                return self.convolution(block.full, x, nx, 4)
            case Tcn():
                for level, part in enumerate(block.blocks):
                    x, nx = self.residual(part, x, nx, 2**level)
                return x, nx
            case Parallel():
                return self.parallel(block, x, nx)
        return self.part(block, x, nx)

    def part(self, block: Any, x: str, nx: int) -> tuple[str, int]:
        """Write a block that the networks of the paper do not have."""
        if isinstance(block, Stacked):
            for part in block.blocks:
                x, nx = self.block(part, x, nx)
            return x, nx
        writers: dict[type, Callable[[Any, str, int], tuple[str, int]]] = {
            Entry: self.entry, Static: self.static, Lru: self.lru, Filtered: self.filtered,
            StateSpace: self.state_space, Attending: partial(attention_exports.write, self),
        }  # fmt: skip
        for kind, write in writers.items():
            if isinstance(block, kind):
                return write(block, x, nx)
        raise UnusableInput(f"the network has a part, {type(block).__name__}, that has no step from sample to sample")

    def entry(self, block: Entry, x: str, nx: int) -> tuple[str, int]:
        y = self.array(nx + block.gated)
        self.lines.append(f"gated({x}, {nx}, {block.gated}, {y})")
        return self.dense(block.full, y, nx + block.gated)

    def normed(self, layer: Any, x: str, nx: int) -> str:
        y = self.array(nx)
        self.lines.append(f"normed({x}, {nx}, {y}, {self.weights(layer.weight, layer.bias)}, {layer.eps!r})")
        return y

    def dense(self, layer: Any, x: str, nx: int, positive: int = 0) -> tuple[str, int]:
        ny = layer.out_features
        y = self.array(ny)
        self.lines.append(f"dense({x}, {nx}, {y}, {ny}, {self.weights(layer.weight, layer.bias)}, {positive})")
        return y, ny

    def recurrence(self, layer: Any, x: str, nx: int) -> tuple[str, int]:
        name, parts = RECURRENT[type(layer)]
        n = layer.hidden_size
        new, at = self.array(n), self.take(parts * n)
        weights = self.weights(layer.weight_ih_l0, layer.weight_hh_l0, layer.bias_ih_l0, layer.bias_hh_l0)
        self.lines.append(f"{name}({x}, {nx}, s, {at}, {n}, {new}, {weights})")
        return new, n

    def convolution(self, layer: Convolution, x: str, nx: int, dilation: int) -> tuple[str, int]:
        ny, kernel = layer.out_channels, layer.kernel_size[0]
        y, at = self.array(ny), self.take(((kernel - 1) * dilation + 1) * nx)
        weights = self.weights(layer.weight, layer.bias)
        self.lines.append(f"convolution({x}, {nx}, s, {at}, {y}, {ny}, {weights}, {kernel}, {dilation})")
        return y, ny

    def residual(self, part: Residual, x: str, nx: int, dilation: int) -> tuple[str, int]:
        inner, ny = self.convolution(part.one, x, nx, dilation)
        inner, ny = self.convolution(part.two, inner, ny, dilation)
        around = x if part.through is None else self.dense(part.through, x, nx)[0]
        y = self.array(ny)
        self.lines.append(f"add({inner}, {around}, {ny}, {y}, 1)")
        return y, ny

    def parallel(self, block: Parallel, x: str, nx: int) -> tuple[str, int]:
        branches = [self.block(branch, x, nx) for branch in block.blocks]
        size = sum(n for _, n in branches)
        z, at = self.array(size), 0
        for branch, n in branches:
            self.lines.append(f"copy({branch}, {n}, {z}, {at})")
            at += n
        wide, _ = self.dense(block.wide, *self.dense(block.narrow, z, size, 1))
        y = self.array(size)
        self.lines.append(f"add({z}, {wide}, {size}, {y}, 0)")
        return y, size

    def static(self, block: Static, x: str, nx: int) -> tuple[str, int]:
        inner, hidden = self.dense(block.inner, x, nx)
        self.lines.append(f"squash({inner}, {hidden})")
        outer, _ = self.dense(block.outer, inner, hidden)
        y = self.array(nx)
        self.lines.append(f"add({x}, {outer}, {nx}, {y}, 0)")
        return y, nx

    def lru(self, block: Lru, x: str, nx: int) -> tuple[str, int]:
        layer = block.recurrence
        entry = layer.entry()
        states = len(entry)
        v, at, y = self.array(states), self.take(states), self.array(nx)
        gated, around = self.array(nx), self.array(nx)
        weights = self.weights(entry, torch.zeros(states))
        self.lines.append(f"dense({x}, {nx}, {v}, {states}, {weights}, 0)")
        self.lines.append(f"diagonal({v}, s, {at}, {states // 2}, {self.weights(*layer.poles())})")
        weights = self.weights(layer.weight_out, layer.through)
        self.lines.append(f"read_off({x}, {nx}, s, {at}, {states}, {y}, {weights})")
        value, opening = self.dense(block.value, y, nx)[0], self.dense(block.gate, y, nx)[0]
        self.lines.append(f"gate({value}, {opening}, {nx}, {gated})")
        self.lines.append(f"add({x}, {gated}, {nx}, {around}, 0)")
        return around, nx

    def filtered(self, block: Filtered, x: str, nx: int) -> tuple[str, int]:
        for num, den in block.filters.sections():
            y, at = self.array(nx), self.take(2 * nx)
            self.lines.append(f"section({x}, {nx}, s, {at}, {y}, {self.weights(num, den)})")
            x = y
        return x, nx

    def state_space(self, block: StateSpace, x: str, nx: int) -> tuple[str, int]:
        n, size = block.size, block.size + block.nu
        at, y = self.take(n), self.array(size)
        self.lines += [f"read(s, {at}, {n}, {y})", f"copy({x}, {block.nu}, {y}, {n})"]
        linear, zeros = block.linear(), torch.zeros(n)
        free = self.bent(y, size, (linear, zeros), block.inner, (block.weight_out, zeros))
        self.lines.append(f"copy({free}, {n}, s, {at})")
        if block.encoder is not None:
            found = self.encoded(block.encoder, x, nx)
            self.lines.append(f"hold({found}, {n}, s, {at}, {x}[{nx - 1}])")
        return y, block.integrated or size

    def encoded(self, encoder: Encoder, x: str, nx: int) -> str:
        size = encoder.past * nx
        at, rows = self.take(size), self.array(size)
        self.lines += [f"remember({x}, {nx}, s, {at}, {encoder.past})", f"read(s, {at}, {size}, {rows})"]
        linear, outer = (encoder.weight(), encoder.linear.bias), (encoder.outer.weight, encoder.outer.bias)
        return self.bent(rows, size, linear, encoder.inner, outer)

    def bent(self, x: str, nx: int, linear: Any, inner: Any, outer: Any) -> str:
        """Write W x + b + V tanh(U x + c) + d of the weights (W, b), the layer (U, c) and the weights (V, d)."""
        n, y = len(linear[0]), self.array(len(linear[0]))
        hidden, size = self.dense(inner, x, nx)
        bent = self.array(n)
        self.lines += [
            f"dense({x}, {nx}, {y}, {n}, {self.weights(*linear)}, 0)", f"squash({hidden}, {size})",
            f"dense({hidden}, {size}, {bent}, {n}, {self.weights(*outer)}, 0)", f"add({y}, {bent}, {n}, {y}, 0)",
        ]  # fmt: skip
        return y


def step_form(model: Any, nu: int, ny: int) -> StepForm:
    """Write a trained network as a step; at rest its states are zero. Raises UnusableInput for unknown parts."""
    writer, inputs, window = _Writer(), model.inputs, model.window
    if model.windowed and window % 4 and any(isinstance(part, Pooled) for part in model.trained.modules()):
        raise UnusableInput(f"a window of {window} samples is no multiple of four, which a pooled one takes in a step")
    y, _ = writer.block(copy.deepcopy(model.trained).double(), "x", inputs)  # poles come out of single weights
    layers = "\n    ".join(
        ["def layers(s: list, x: list, y: list):", '"""Take the features x of a sample through the network."""',
         *writer.lines, f"copy({y}, {ny}, y, 0)"]
    )  # fmt: skip
    scaling = {"X_MIDDLE": model.of_x.middle, "X_HALF": model.of_x.half, "Y_MIDDLE": model.of_y.middle,
               "Y_HALF": model.of_y.half}  # fmt: skip
    constants = {name: np.array(value) for name, value in scaling.items()} | writer.constants
    size, count = writer.cells, writer.cells + window * inputs
    step = (WINDOWED if model.windowed else STATEFUL).format(
        inputs=inputs, nu=nu, ny=ny, window=window, buffer=size, count=count, dt=model.dt
    )
    source = "\n\n".join([*map(source_of, LAYERS), layers + "\n", step]).replace("\n\ndef", "\n\n\ndef")
    rest = np.zeros(count + 1 if model.windowed else max(size, 1))
    return StepForm(source, constants, rest, nu, ny, not model.windowed)


def start(model: Any, u: Float[np.ndarray, "T nu"], y_init: Float[np.ndarray, "n ny"]) -> Float[np.ndarray, " ns"]:
    """Return the state of that step after n measured samples."""
    n, (nu, ny) = len(y_init), (u.shape[1], y_init.shape[1])
    form = step_form(model, nu, ny)
    x = model.of_x.inside(features(u, model.dt, model.windowed))[:n]
    state = form.rest.tolist()
    if model.windowed:
        rows = np.concatenate((np.repeat(x[:1], max(0, model.window - n), axis=0), x[-model.window :]))
        size = len(state) - 1 - rows.size
        return np.concatenate((np.zeros(size), rows.ravel(), [float(n)]))
    layers, y = form.functions["layers"], [0.0] * ny
    for row in np.column_stack((x, model.of_y.inside(y_init), np.ones(n))).tolist():
        layers(state, row, y)
    return np.array(state)
