"""Block models from a linear one: its poles and zeros shared out over two filters, a curve between them, refined."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Literal

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.batches import excerpt, stack
from simgap.baselines.estimation.block_error import BlockError
from simgap.baselines.estimation.blocks import Blocks, Run
from simgap.baselines.estimation.curve_kernels import basis, spline
from simgap.baselines.estimation.filters import divide, multiply
from simgap.baselines.estimation.levenberg import minimise
from simgap.records import Experiment, TrainingSet

Kind = Literal["wiener", "hammerstein", "wiener-hammerstein"]
FREE = {
    "wiener": ("f1", "b1", "c"),
    "hammerstein": ("c", "f2", "b2"),
    "wiener-hammerstein": ("f1", "b1", "c", "f2", "b2"),
}
EXCERPT = 8192  # samples to compare structures on
COARSE, FINE = 9, (14, 20, 28)  # coefficients of a curve
KEPT = 4  # partitions that are refined
WORTH = 0.03  # a structure with more numbers must lower the held-out RMSE by so much
FINAL = 40  # steps on all records
NEW_ROOT = 0.3  # where a pole and a zero that cancel are added


@dataclass(frozen=True, eq=False)
class Search:
    """The records of one output, training and held out, and how a model is refined on them."""

    kind: Kind
    data: TrainingSet
    output: int

    def best(self, starts: Sequence[Blocks]) -> Blocks:
        """Choose the structure with the smallest held-out simulation error, grown from the best of the starts.

        Each round adds a pole and a zero to the filters of the two best; then the curve gets more knots. Where no
        curve beats the linear model, nothing is grown.
        """
        found = sorted((self.refined(start, 30) for start in starts), key=lambda pair: pair[1])
        linear = min(self.error(self._straight(model)) for model in (*starts, found[0][0]))
        if found[0][1] > (1 - WORTH) * linear:
            return found[0][0]
        while True:
            grown = [self.refined(larger, 50) for model, _ in found[:2] for larger in self._longer(model)]
            best = min(grown, key=lambda pair: pair[1])
            if best[1] > (1 - WORTH) * found[0][1]:
                break
            found = sorted([*grown, found[0]], key=lambda pair: pair[1])
        best = found[0]
        for count in FINE:
            finer = self.refined(self._with_knots(best[0], count, excerpt(self.data.train, EXCERPT)), 40)
            best = finer if finer[1] < (1 - WORTH) * best[1] else best
        return best[0]

    def refined(self, start: Blocks, steps: int, records: Sequence[Experiment] | None = None) -> tuple[Blocks, float]:
        """Minimise the simulation error by Levenberg-Marquardt; the model, and its held-out RMSE."""
        records = records or excerpt(self.data.train, EXCERPT)
        equation = BlockError.of(start, records, self.output, self.data.n_init, FREE[self.kind])
        minimum = minimise(equation, equation.theta, steps)
        noise = float(np.sqrt(minimum.cost.squares / equation.samples))
        model = replace(equation.at(minimum.theta), noise=noise)
        model = replace(model, x_size=self._signals(model, records).std(axis=1))
        return model, self.error(model)

    def error(self, model: Blocks) -> float:
        """Compute the RMSE of the free run on held-out records, or on training records where there are none."""
        squares = samples = 0.0
        for u, y in stack(self.data.held_out):
            y_hat = model.simulate(u, y[:, : self.data.n_init, self.output])
            squares += float(np.sum((y_hat - y[:, self.data.n_init :, self.output]) ** 2))
            samples += y_hat.size
        return float(np.sqrt(squares / samples)) if np.isfinite(squares) else np.inf

    def on_everything(self, model: Blocks) -> Blocks:
        """Estimate the numbers anew from all records, with knots of the same distance as far as those reach."""
        records = [*self.data.train, *self.data.valid]
        spans = np.ptp(self._signals(model, records), axis=1) / model.step
        count = max(int(np.ceil(spans.max())) + 3, model.c.shape[1])
        return self.refined(self._with_knots(model, count, records), FINAL, records)[0]

    def _signals(self, model: Blocks, records: Sequence[Experiment]) -> Float[np.ndarray, "m n"]:
        """Simulate what goes into the curves."""
        parts = []
        for u, y in stack([x for x in records if len(x) > self.data.n_init]):
            deviation, start = u - model.u_mean, y[:, : self.data.n_init, self.output] - model.y_mean
            run = Run.of(model, deviation, model.start_state(deviation[:, : self.data.n_init], start))
            parts.append(run.x.reshape(len(run.x), -1))
        return np.concatenate(parts, axis=1)

    def _straight(self, model: Blocks) -> Blocks:
        """Replace each curve by its line of best fit where the signals are; a spline's line stands in its c."""
        lines = []
        for i, x in enumerate(self._signals(model, excerpt(self.data.train, EXCERPT))):
            f, _ = spline(x, model.low[i], model.step[i], model.c[i])
            at = model.low[i] + model.step[i] * np.arange(-1, model.c.shape[1] - 1)
            lines.append(np.polyval(np.polyfit(x, f, 1), at))
        return replace(model, c=np.array(lines))

    def _with_knots(self, model: Blocks, count: int, records: Sequence[Experiment]) -> Blocks:
        """Write the curves with `count` coefficients over the range that these records need."""
        low, step, c = [], [], []
        for i, x in enumerate(self._signals(model, records)):
            new = knots(x, count)
            grid = np.linspace(x.min(), x.max(), 20 * count)
            f, _ = spline(grid, model.low[i], model.step[i], model.c[i])
            low.append(new[0])
            step.append(new[1])
            c.append(np.linalg.lstsq(basis(grid, *new, count).T, f, rcond=1e-10)[0])
        return replace(model, low=np.array(low), step=np.array(step), c=np.array(c))

    def _longer(self, model: Blocks) -> Iterator[Blocks]:
        """Yield the model with a pole and a zero that cancel in one filter, and in both."""
        filters = [name[1] for name in FREE[self.kind] if name[0] == "f"]
        for chosen in ("1", "2", "12"):
            if set(chosen) <= set(filters):
                more = np.array([1.0, -NEW_ROOT])
                changed = {}
                for part in chosen:
                    changed[f"f{part}"] = np.convolve(getattr(model, f"f{part}"), more)
                    b = getattr(model, f"b{part}")
                    changed[f"b{part}"] = np.apply_along_axis(np.convolve, -1, b, more)
                yield replace(model, **changed)


def starts(
    kind: Kind,
    records: Sequence[Experiment],
    output: int,
    f: Float[np.ndarray, " N1"],
    b: Float[np.ndarray, "nu L"],
    u_mean: Float[np.ndarray, " nu"],
    y_mean: float,
) -> list[Blocks]:
    """Build block models from a linear one, B/F, and keep the best: its poles and zeros shared out in every way.

    Poles and zeros of a Wiener-Hammerstein system's best linear approximation are those of its two filters (Sjoberg
    and Schoukens, Automatica 48, 2012); of each partition the curve is found by linear least squares.
    """
    nu = len(b)
    if kind == "hammerstein":
        shares = [(np.ones(1), np.eye(nu)[:, :, None], f, b)]
    elif kind == "wiener" or nu > 1:
        shares = [(f, b[None], np.ones(1), np.ones((1, 1)))]
    else:
        shares = list(_partitions(f, b[0]))
    glance = [(u - u_mean, y[:, :, output] - y_mean) for u, y in stack(excerpt(records, EXCERPT))]
    fits = sorted((_with_curve(share, f, glance, u_mean, y_mean) for share in shares), key=lambda model: model.noise)
    return fits[:KEPT]


def knots(x: Float[np.ndarray, " n"], count: int) -> tuple[float, float]:
    """Place the lowest knot, and the step, so that `count` coefficients span the values of x."""
    low, high = float(x.min()), float(x.max())
    return low, max(high - low, 1e-9) / (count - 3)


def _partitions(f: np.ndarray, b: np.ndarray) -> Iterator[tuple[np.ndarray, ...]]:
    """Yield f1, b1, f2, b2 for every way to share out poles and zeros, conjugate pairs together."""
    delay = int(np.argmax(b != 0))
    poles, zeros = _groups(np.roots(f)), _groups(np.roots(b[delay:]))
    for chosen in product((True, False), repeat=len(poles) + len(zeros)):
        f1, f2 = _polynomials(poles, chosen[: len(poles)])
        b1, b2 = _polynomials(zeros, chosen[len(poles) :])
        b1 = np.concatenate((np.zeros(delay), b[delay] * b1))
        yield f1, b1[None, None], f2, b2[None]


def _groups(roots: np.ndarray, most: int = 5) -> list[list[complex]]:
    """Group roots that stay together: conjugate pairs, and beyond `most` groups the nearest real ones."""
    values: list[complex] = [complex(r) for r in roots]
    groups = [[r, r.conjugate()] for r in values if r.imag > 0]
    groups += [[r] for r in sorted((r for r in values if r.imag == 0), key=lambda r: r.real)]
    while len(groups) > most:
        last = groups.pop()
        groups[-1] = groups[-1] + last
    return groups


def _polynomials(groups: list[list[complex]], chosen: Sequence[bool]) -> tuple[np.ndarray, np.ndarray]:
    def side(first: bool) -> np.ndarray:
        roots = [r for group, taken in zip(groups, chosen, strict=True) if taken == first for r in group]
        return np.atleast_1d(np.real(np.poly(roots)))

    return side(True), side(False)


def _with_curve(share: tuple, f: np.ndarray, batches: list, u_mean: np.ndarray, y_mean: float) -> Blocks:
    """Find the curves of a partition by least squares; what start states add, responses of 1/F, is projected out."""
    f1, b1, f2, b2 = share
    signals = [_filtered(b1, f1, u).sum(axis=1) for u, _ in batches]  # [m, B, T] each
    flat = np.concatenate([x.reshape(len(x), -1) for x in signals], axis=1)
    if len(f1) > 1:
        size = np.maximum(flat.std(axis=1), 1e-12)
        b1, flat = b1 / size[:, None, None], flat / size[:, None]
        signals = [x / size[:, None, None] for x in signals]
    low, step = (np.array(part) for part in zip(*(knots(x, COARSE) for x in flat), strict=True))
    columns = []
    for x, (_, y) in zip(signals, batches, strict=True):
        parts = []
        for i in range(len(x)):
            values = basis(x[i].ravel(), low[i], step[i], COARSE).reshape(COARSE, *y.shape)
            parts.append(divide(multiply(b2[i], values), f2))
        length = y.shape[1]
        free = np.linalg.qr(divide(np.eye(min(len(f) - 1, length // 4), length), f).T)[0]
        own = np.concatenate((*parts, y[None]))  # [m K + 1, B, T]
        own = own - (own @ free) @ free.T
        columns.append(own.reshape(len(own), -1))
    rows = np.concatenate(columns, axis=1)
    gram = rows @ rows.T
    c = np.linalg.lstsq(gram[:-1, :-1], gram[:-1, -1], rcond=1e-12)[0]
    e = rows[-1] - c @ rows[:-1]
    y_size = float(np.std(np.concatenate([y.ravel() for _, y in batches]))) or 1.0
    x_size = flat.std(axis=1)
    return Blocks(b1, f1, c.reshape(len(b1), -1), low, step, b2, f2, u_mean, y_mean, float(np.std(e)), x_size, y_size)


def _filtered(b1: np.ndarray, f1: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Filter every input of u [B, T, nu] into every branch, [m, nu, B, T]."""
    return np.stack([np.stack([divide(multiply(b, u[:, :, j]), f1) for j, b in enumerate(of)]) for of in b1])
