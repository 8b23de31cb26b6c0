"""What a grey box with a learnt rest adds to its outputs, as a step form (`simgap.greybox.rest`, `hybrid`)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.exports.grey_boxes import GreyBoxStep
from simgap.exports.writers import Cells
from simgap.greybox.model import GreyBoxModel
from simgap.greybox.rest import Rest, RestOfOutput
from simgap.greybox.rest_features import FAR, SHAPES_AT_A_TIME
from simgap.step_form import StepForm, source_of


def append(x: list, n: int, s: list, at: int, length: int, k: int):
    """Append x to the last `length` ones, from s[at] on; before the record it stood still."""
    for i in range((length - 1) * n):
        s[at + i] = s[at + n + i]
    for i in range(n):
        s[at + (length - 1) * n + i] = x[i]
        if k == 0:
            for j in range(length):
                s[at + j * n + i] = x[i]


def follow(x: float, s: list, at: int, q: float, k: int):
    """Take the running mean at s[at] on to x, and return it."""
    s[at] = q * s[at] + (1 - q) * x if k > 0 else x
    return s[at]


def weighted_features(
    phi: list, n: int, s: list, at: int, c: list, first: int, den: list, order: int, after: list, means: int, k: int
):
    """Sum c times phi [n], phi one sample before, what passed the poles of the plant, and running means of phi."""
    total = 0.0
    for i in range(n):
        base = at + i * (1 + order + means)
        passed = phi[i]
        for r in range(1, order + 1):
            if r <= k:
                passed -= den[r] * s[base + r]
        if k == 0:
            for r in range(order + 1):
                s[base + r] = phi[i]
        total += c[first + i] * phi[i] + c[first + n + i] * s[base]
        for r in range(1, order + 1):
            total += c[first + (1 + r) * n + i] * s[base + r]
        for r in range(means):
            mean = follow(phi[i], s, base + 1 + order + r, after[r], k)
            total += c[first + (2 + order + r) * n + i] * mean
        s[base] = phi[i]
        for r in range(1, order):
            s[base + order + 1 - r] = s[base + order - r]
        if order > 0:
            s[base + 1] = passed
    return total


def wave(z: list, n: int, shapes: int, shape: int, w: list, b: list):
    """cos(w z + b) of one shape."""
    total = b[shape]
    for i in range(n):
        total += w[i * shapes + shape] * z[i]
    return math.cos(total)


def filtered(s: list, at: int, n: int, taps: int, w: list, row: int):
    """Sum the last `taps` of n signals, oldest first from s[at] on, through row `row` of impulse responses."""
    total = 0.0
    for i in range(n):
        for j in range(taps):
            total += w[(row * n + i) * taps + j] * s[at + j * n + i]
    return total


FUNCTIONS = (append, follow, weighted_features, wave, filtered)


class GreyBoxWithRest:
    """A grey box and what was learnt of its errors, as a step form with its starts."""

    def __init__(self, model: GreyBoxModel, rest: Rest, nu: int, ny: int) -> None:
        self.grey, self.nu, self.ny = GreyBoxStep(model, nu, ny), nu, ny
        self.cells = Cells(len(self.grey.form.rest))
        self.constants = dict(self.grey.form.constants)
        count = self.cells.take(1)
        lines = [f"k = int(s[{count}])", "grey_step(s, u, y)", f"signals = [0.0] * {nu + 2 * ny}"]
        changes = self.cells.take(ny)
        lines += [line for i in range(nu) for line in (f"signals[{i}] = u[{i}]",)]
        for i in range(ny):
            lines += [f"signals[{nu + i}] = y[{i}]",
                      f"signals[{nu + ny + i}] = y[{i}] - s[{changes + i}] if k > 0 else 0.0",
                      f"s[{changes + i}] = y[{i}]"]  # fmt: skip
        for j, of_output in enumerate(rest.outputs):
            if isinstance(of_output, RestOfOutput):
                lines += self._features(j, of_output)
            elif of_output is not None:
                lines += self._network(j, of_output)
        body = "\n    ".join([*lines, f"s[{count}] = k + 1"])
        step = f'def step(s: list, u: list, y: list):\n    """Simulate, and add what was learnt."""\n    {body}\n'
        grey = self.grey.form.source.replace("def step(", "def grey_step(")
        source = "\n\n\n".join([grey.rstrip(), *(source_of(one).rstrip() for one in FUNCTIONS), step])
        self.form = StepForm(source, self.constants, np.zeros(self.cells.taken), nu, ny, True, held=self.grey.form.held)

    def _constant(self, name: str, value: Any) -> str:
        self.constants[name] = np.asarray(value, dtype=np.float64).ravel()
        return name

    def _scaled(self, j: int, means: np.ndarray, sizes: np.ndarray, far: bool) -> list[str]:
        n = len(means)
        value = f"(signals[i] - {self._constant(f'M{j}', means)}[i]) / {self._constant(f'S{j}', sizes)}[i]"
        return [
            f"for i in range({n}):",
            f"    z{j}[i] = " + (f"min(max({value}, -{FAR!r}), {FAR!r})" if far else value),
        ]

    def _features(self, j: int, rest: RestOfOutput) -> list[str]:
        design, features = rest.features.design, rest.features
        n, lags, before = len(features.means), design.lags, design.before
        size, shapes, order = len(features.w), len(features.b), len(features.denominator) - 1
        after = [float(np.exp(-1.0 / samples)) for samples in design.after]
        lines = [
            f"z{j} = [0.0] * {size}",
            f"f{j} = [0.0] * {SHAPES_AT_A_TIME}",
            *self._scaled(j, features.means, features.sizes, True),
        ]
        if lags:
            length = max(lags) + 1
            at = self.cells.take(length * n)
            lines.append(f"append(z{j}, {n}, s, {at}, {length}, k)")
            for i, lag in enumerate(lags, start=1):
                lines += [f"for i in range({n}):", f"    z{j}[{i * n} + i] = s[{at + (length - 1 - lag) * n} + i]"]
        for i, samples in enumerate(before, start=1 + len(lags)):
            at, q = self.cells.take(n), float(np.exp(-1.0 / samples))
            lines += [f"for i in range({n}):", f"    z{j}[{i * n} + i] = follow(z{j}[i], s, {at} + i, {q!r}, k)"]
        c, den = self._constant(f"K{j}", rest.coefficients), self._constant(f"D{j}", features.denominator)
        means = self._constant(f"Q{j}", after or [0.0])
        lines.append(f"e{j} = {-float(rest.means @ rest.coefficients)!r}")
        first, stride = 0, 1 + order + len(after)

        def weigh(array: str, count: int) -> str:
            nonlocal first
            at = self.cells.take(count * stride)
            call = f"{array}, {count}, s, {at}, {c}, {first}, {den}, {order}, {means}, {len(after)}, k"
            first += count * (1 + stride)
            return f"e{j} += weighted_features({call})"

        lines.append(weigh(f"z{j}", size))
        w, b = self._constant(f"W{j}", features.w), self._constant(f"B{j}", features.b)
        for some in range(0, shapes, SHAPES_AT_A_TIME):
            count = min(SHAPES_AT_A_TIME, shapes - some)
            lines += [f"for i in range({count}):", f"    f{j}[i] = wave(z{j}, {size}, {shapes}, {some} + i, {w}, {b})"]
            lines.append(weigh(f"f{j}", count))
        return [*lines, f"y[{j}] += min(max(e{j}, {-rest.largest!r}), {rest.largest!r})"]

    def _network(self, j: int, rest: Any) -> list[str]:
        """Write B(q) tanh(A(q) z + a) + L(q) z + c; it sees no changes of the outputs."""
        a, offsets, b, linear, offset = rest.weights
        n, curves, taps = len(rest.means), len(a), a.shape[2]
        at, behind = self.cells.take(taps * n), self.cells.take(taps * curves)
        names = [self._constant(f"{x}{j}", value) for x, value in zip("AOBL", (a, offsets, b, linear), strict=True)]
        lines = [f"z{j} = [0.0] * {n}", f"f{j} = [0.0] * {curves}", *self._scaled(j, rest.means, rest.sizes, False)]
        lines += [
            f"append(z{j}, {n}, s, {at}, {taps}, k)", f"for i in range({curves}):",
            f"    f{j}[i] = math.tanh(filtered(s, {at}, {n}, {taps}, {names[0]}, i) + {names[1]}[i])",
            f"append(f{j}, {curves}, s, {behind}, {taps}, k)",
            f"e{j} = filtered(s, {behind}, {curves}, {taps}, {names[2]}, 0)",
            f"e{j} += filtered(s, {at}, {n}, {taps}, {names[3]}, 0) + {float(np.ravel(offset)[0])!r}",
            f"e{j} = {float(rest.size)!r} * e{j}",
        ]  # fmt: skip
        return [*lines, f"y[{j}] += min(max(e{j}, {-rest.largest!r}), {rest.largest!r})"]

    def start(self, u: Float[np.ndarray, "T nu"], y_init: Float[np.ndarray, "n ny"]) -> Float[np.ndarray, " ns"]:
        """Return the state before sample n, from the start that suits the first n samples."""
        state = self.form.rest.copy()
        for writer in self.grey.writers:
            writer.start(u, y_init, state)
        return self.form.run_on(u[: len(y_init)], state)[1]
