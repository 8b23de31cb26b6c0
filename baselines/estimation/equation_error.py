"""ARX: A(q) y = B(q) u + e by linear least squares."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from simgap.baselines.estimation.fitted import LinearFit, Row, moved_operating_point
from simgap.baselines.estimation.gram import Gram
from simgap.baselines.estimation.least_squares import solve
from simgap.baselines.estimation.orders import Orders
from simgap.baselines.estimation.polynomial import Polynomial
from simgap.records import TrainingSet, UnusableInput


def estimate_arx(gram: Gram, orders: Orders, constant: bool = True) -> LinearFit:
    """Solve one least-squares problem per output, all from one Gram matrix (Ljung 1999, eq. 4.12 and 7.34).

    Raises TooFewSamples when the experiments are too short for the order.
    """
    ny, nu = orders.nb.shape
    constants, rows = np.zeros(ny), []
    for i in range(ny):
        regressors = orders.lagged(i)
        check_length(gram.rows, len(regressors) + constant, gram.max_lag)
        estimate = solve(gram, (i, 0), regressors, constant)
        sign = np.array([-1.0 if signal < ny else 1.0 for signal, _ in regressors])
        constants[i] = estimate.constant
        rows.append(
            Row(
                coefficient_names(regressors, ny, nu),
                sign * estimate.theta,
                estimate.covariance * np.multiply.outer(sign, sign),
                estimate.variance,
                estimate.rank,
            )
        )
    return assemble(gram, orders, tuple(rows), constants, [np.ones(1)] * ny)


def assemble(
    gram: Gram, orders: Orders, rows: tuple[Row, ...], constants: np.ndarray, noise: Sequence[np.ndarray]
) -> LinearFit:
    """Put the equations of all outputs, their constants and their C into one model."""
    ny, nu = orders.nb.shape
    order = orders.state
    a, b = np.zeros((order + 1, ny, ny)), np.zeros((order + 1, ny, nu))
    a[0] = np.eye(ny)
    c = a.copy()
    for i, row in enumerate(rows):
        for (signal, lag), value in zip(orders.lagged(i), row.values, strict=False):  # those of C follow
            if signal < ny:
                a[lag, i, signal] = value
            else:
                b[lag, i, signal - ny] = value
        c[: len(noise[i]), i, i] = noise[i]
    y_mean, u_mean = moved_operating_point(a, b, constants, gram.shift, gram.spread)
    polynomial = Polynomial(a, b, c, u_mean, y_mean, gram.experiments[0].dt)
    return LinearFit(polynomial, orders, rows, constants, gram.rows)


class TooFewSamples(UnusableInput):
    """The experiments are too short for the model's order."""


def check_length(rows: int, parameters: int, lags: int) -> None:
    """Raise TooFewSamples if `rows` equations, of samples after the first `lags`, are no more than the parameters."""
    if rows <= parameters:
        raise TooFewSamples(
            f"too few samples for the model's order: {parameters} coefficients from {rows} equations "
            f"(each experiment gives its length less {lags}); lower the order or record more"
        )


def check_found(found: Sequence[Any], data: TrainingSet) -> None:
    """Raise TooFewSamples if no structure could be estimated."""
    if not found:
        longest = max(map(len, data.train))
        raise TooFewSamples(
            f"too few samples for any structure: the longest training experiment has {longest}; record more"
        )


def coefficient_names(regressors: list[tuple[int, int]], ny: int, nu: int) -> tuple[str, ...]:
    """Name coefficients a1, b0, ..., with the channel where there are several: a1_2 weighs output 2, one sample ago."""
    names = []
    for signal, lag in regressors:
        letter, channel, count = ("a", signal, ny) if signal < ny else ("b", signal - ny, nu)
        names.append(f"{letter}{lag}" if count == 1 else f"{letter}{lag}_{channel + 1}")
    return tuple(names)
