"""ARMAX: A(q) y = B(q) u + C(q) e by minimising the one-step prediction error from two linear estimates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.batches import stack
from simgap.baselines.estimation.equation_error import assemble, check_length, coefficient_names, estimate_arx
from simgap.baselines.estimation.filters import multiply
from simgap.baselines.estimation.fitted import LinearFit, Row
from simgap.baselines.estimation.gram import Gram, lagged_gram
from simgap.baselines.estimation.levenberg import minimise
from simgap.baselines.estimation.orders import Orders
from simgap.baselines.estimation.prediction_error import PredictionError
from simgap.records import Experiment


def estimate_armax(
    experiments: Sequence[Experiment],
    shift: Float[np.ndarray, " S"],
    orders: Orders,
    constant: bool = True,
    start: LinearFit | None = None,
) -> LinearFit:
    """Minimise sum e^2 of C(q) e = A(q) y - B(q) u, one output at a time, C kept stable.

    The search begins at `start`, an earlier fit, and around its operating point, or else at two linear estimates.
    Ljung 1999, sections 7.2 and 10.2. Raises TooFewSamples when the experiments are too short for the order.
    """
    gram = lagged_gram(experiments, start.operating_point if start else shift, orders.max_lag)
    ny = len(orders.na)
    rows, constants, noise = [], np.zeros(ny), []
    for i in range(ny):
        check_length(gram.rows, len(orders.lagged(i)) + int(orders.nc[i]) + constant, gram.max_lag)
        equation = PredictionError.of(gram, orders, i, constant)
        thetas = [equation.theta_of(start.rows[i])] if start else armax_starts(gram, orders, i, equation)
        searches = [minimise(equation, theta) for theta in thetas]
        best = min(searches, key=lambda search: search.cost.squares)
        names = coefficient_names(orders.lagged(i), *orders.nb.shape)
        names += tuple(f"c{k}" for k in range(1, equation.nc + 1))
        rows.append(Row.at(best, names, equation.coefficients, equation.samples))
        constants[i] = best.theta[equation.linear - 1] if constant else 0.0
        noise.append(equation.noise(best.theta))
    return assemble(gram, orders, tuple(rows), constants, noise)


def armax_starts(gram: Gram, orders: Orders, output: int, equation: PredictionError) -> Iterator[np.ndarray]:
    """Yield theta of plain ARX and of Hannan and Rissanen's regression on the errors of a long ARX model (1982)."""
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
    """Compute the one-step errors [B, before + T - skip] of one output, zero where they are not known."""
    model = fit.polynomial
    e = np.zeros((y.shape[0], before + y.shape[1] - skip))
    signals = np.concatenate((y - model.y_mean, u - model.u_mean), axis=2)
    taps = np.concatenate((model.a, -model.b), axis=2)[:, output]  # [N1, S]
    e_known = np.sum([multiply(taps[:, s], signals[:, :, s]) for s in range(signals.shape[2])], axis=0)
    e[:, before + model.order - skip :] = e_known[:, model.order :]
    return e
