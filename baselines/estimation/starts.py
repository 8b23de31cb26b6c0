"""Where the searches for ARMAX and output-error models begin: linear least squares, in several disguises."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from simgap.baselines.estimation.batches import stack
from simgap.baselines.estimation.equation_error import estimate_arx
from simgap.baselines.estimation.filters import divide, multiply
from simgap.baselines.estimation.fitted import LinearFit
from simgap.baselines.estimation.gram import Gram, lagged_gram
from simgap.baselines.estimation.levenberg import stable
from simgap.baselines.estimation.orders import Orders
from simgap.records import Experiment

if TYPE_CHECKING:
    from simgap.baselines.estimation.output_error import OutputError
    from simgap.baselines.estimation.prediction_error import PredictionError


def armax_starts(gram: Gram, orders: Orders, output: int, equation: PredictionError) -> Iterator[np.ndarray]:
    """Plain ARX, and Hannan and Rissanen's regression on the errors of a long ARX model (1982)."""
    arx = estimate_arx(gram, orders, equation.constant)
    constant = arx.constants[output : output + 1] if equation.constant else []
    yield np.concatenate((arx.rows[output].values, constant, np.zeros(equation.nc)))
    if equation.nc == 0:
        return
    # Long enough for 1/C to have died out, short enough to be estimated: log(T)^1.5, about 28 of 10,000 samples.
    shortest = min(map(len, gram.experiments))
    length = min(orders.max_lag + int(np.log(equation.samples) ** 1.5), shortest // 4)
    length = max(orders.max_lag, min(length, equation.samples // (4 * sum(orders.nb.shape))))
    long = Orders.of(*orders.nb.shape, na=length, nb=length, nk=1)
    long_fit = estimate_arx(lagged_gram(gram.experiments, gram.shift, length), long)
    errors = [_errors_of(long_fit, u, y, output, gram.max_lag, equation.nc) for u, y in stack(gram.experiments)]
    yield equation.pseudo_linear(errors)


def _errors_of(fit: LinearFit, u: np.ndarray, y: np.ndarray, output: int, skip: int, before: int) -> np.ndarray:
    """[B, before + T - skip]: one-step errors of one output, zero where they are not known."""
    model = fit.polynomial
    e = np.zeros((y.shape[0], before + y.shape[1] - skip))
    signals = np.concatenate((y - model.y_mean, u - model.u_mean), axis=2)
    taps = np.concatenate((model.a, -model.b), axis=2)[:, output]  # [N1, S]
    known = np.sum([multiply(taps[:, s], signals[:, :, s]) for s in range(signals.shape[2])], axis=0)
    e[:, before + model.order - skip :] = known[:, model.order :]
    return e


def oe_starts(
    experiments: Sequence[Experiment], shift: np.ndarray, orders: Orders, output: int, equation: OutputError
) -> Iterator[np.ndarray]:
    """ARX on the data and on the free run of a long ARX, each refined by Steiglitz and McBride (1965)."""
    ny = len(orders.nb)
    kept = [output, *range(ny, len(shift))]
    own = [Experiment(e.name, e.u, e.y[:, output : output + 1], e.dt) for e in experiments]
    yield from _prefiltered(own, shift[kept], equation)
    lags = max(orders.max_lag, int(orders.nf.max()))
    length = min(3 * lags + 20, min(map(len, own)) // 4, sum(map(len, own)) // (4 * len(kept)))
    if length > lags:
        long = Orders.of(1, len(kept) - 1, na=length, nb=length, nk=1)
        model = estimate_arx(lagged_gram(own, shift[kept], length), long).polynomial
        if np.abs(model.poles).max() < 1:
            smooth = [
                Experiment("", *simulated, own[0].dt)
                for u, y in stack(own)
                for simulated in zip(u[:, length:], model.simulate(u, y[:, :length]), strict=True)
            ]
            yield from _prefiltered(smooth, shift[kept], equation)


def _prefiltered(experiments: Sequence[Experiment], shift: np.ndarray, equation: OutputError) -> Iterator[np.ndarray]:
    """theta of ARX fits to u/F and y/F, with F from the fit before."""
    nf = max(equation.nf[j] for j in equation.used)
    arx = Orders.of(1, len(equation.nb), na=nf, nb=[list(equation.nb)], nk=[list(equation.nk)])
    f = np.ones(1)
    for _ in range(8):
        filtered = _divided(experiments, shift, f)
        model = estimate_arx(lagged_gram(filtered, np.zeros(len(shift)), arx.max_lag), arx).polynomial
        f = stable(model.a[: nf + 1, 0, 0], radius=1 - 1e-3)[0]
        slowest_first = sorted(np.roots(f), key=abs, reverse=True)
        theta = []
        for j in equation.used:
            own = np.real(np.poly(slowest_first[: equation.nf[j]])) if equation.nf[j] < nf else f
            theta += [own[1:], model.b[equation.nk[j] : equation.nk[j] + equation.nb[j], 0, j]]
        yield np.concatenate([*theta, np.zeros(int(equation.constant))])


def _divided(experiments: Sequence[Experiment], shift: np.ndarray, f: np.ndarray) -> list[Experiment]:
    """The experiments with every signal filtered by 1/F."""
    return [
        Experiment("", *filtered, experiments[0].dt)
        for u, y in stack(experiments)
        for filtered in zip(divide(u - shift[1:], f, axis=1), divide(y - shift[0], f, axis=1), strict=True)
    ]
