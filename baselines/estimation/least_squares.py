"""Least squares on lagged signals, as accurate as QR and without the regressor matrix."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.gram import Gram

# A regressor or target: (signal, lag). Signals are numbered outputs first, then inputs.
Lagged = tuple[int, int]

# Condition numbers of the Gram matrix of unit columns. Below the first, its plain solution is good to 1e-12.
# Up to the second, each refinement with true residuals gains at least five digits; beyond, only QR will do.
WELL_CONDITIONED = 1e4
REFINABLE = 1e10


@dataclass(frozen=True, eq=False)
class Solution:
    """theta [p], its covariance [p, p], the constant, the residual variance and the rank of the regressors."""

    theta: Float[np.ndarray, " p"]
    covariance: Float[np.ndarray, "p p"]
    constant: float
    variance: float
    rank: int


@dataclass(frozen=True, eq=False)
class _Columns:
    """The regressors and, last, the target: which signal at which lag, and what divides them to unit length."""

    signal: np.ndarray
    lag: np.ndarray
    scale: Float[np.ndarray, " p1"]
    with_constant: bool


def solve(gram: Gram, target: Lagged, regressors: Sequence[Lagged], constant: bool) -> Solution:
    """Minimise sum_t (x_target(t) - sum_k theta_k x_k(t - lag_k) - constant)^2 over every experiment.

    The normal equations of unit regressors are solved by eigenvalues and, where they are ill conditioned, refined
    with residuals of the data (Bjorck 1987, corrected seminormal equations); beyond that by QR of stacked pieces.
    """
    p = len(regressors)
    signal, lag = (np.array(part) for part in zip(*regressors, target, strict=True))
    full = gram.products[signal[:, None], lag[:, None], signal, lag]  # [p+1, p+1]
    if constant:
        sums = gram.sums[signal, lag]
        full = full - np.multiply.outer(sums, sums) / max(gram.rows, 1)
    scale = np.sqrt(np.maximum(np.diag(full), 0.0))
    scale[scale == 0] = 1.0
    columns = _Columns(signal, lag, scale, constant)
    unit = full / scale / scale[:, None]
    values, vectors = np.linalg.eigh(unit[:p, :p])
    if p and not values[0] * REFINABLE > values[-1]:
        return _solve_by_qr(gram, columns)
    inverse = (vectors / values) @ vectors.T
    theta = inverse @ unit[:p, p]
    squares = unit[p, p] - theta @ unit[:p, p]
    # A small residual of a large total is lost to rounding as well, so that it comes from the data, too.
    if p and (not values[0] * WELL_CONDITIONED > values[-1] or squares < 1e-6):
        theta, squares = _refine(gram, columns, inverse, theta)
    return _in_units(gram, columns, theta, inverse, squares, p)


def _refine(gram: Gram, columns: _Columns, inverse: np.ndarray, theta: np.ndarray) -> tuple[np.ndarray, float]:
    """Correct theta by the least-squares solution for its residual, until that is rounding noise."""
    gradient, squares = _residual_products(gram, columns, theta)
    last = np.inf
    for _ in range(8):
        change = inverse @ gradient
        size = np.abs(change).max()
        if not size < last:
            break
        theta, last = theta + change, size / 2
        gradient, squares = _residual_products(gram, columns, theta)
    return theta, squares


def _residual_products(gram: Gram, columns: _Columns, theta: np.ndarray) -> tuple[np.ndarray, float]:
    """Compute X^T (y - X theta) and |y - X theta|^2 of unit columns from the data themselves."""
    scale = columns.scale
    coefficients = theta * scale[-1] / scale[:-1]
    constant = _constant(gram, columns, coefficients)
    filters = np.zeros(gram.sums.shape)  # [S, L+1]: the weight of each signal at each lag in residual(t)
    np.add.at(filters, (columns.signal, columns.lag), np.append(-coefficients, 1.0))
    products, squares = np.zeros(gram.sums.shape), 0.0
    for signals in gram.chunks():
        terms = [np.convolve(signal, taps, "valid") for signal, taps in zip(signals, filters, strict=True)]
        residual = np.sum(terms, axis=0) - constant
        products += [np.correlate(signal, residual, "valid")[::-1] for signal in signals]
        squares += float(residual @ residual)
    gradient = products[columns.signal[:-1], columns.lag[:-1]]
    return gradient / scale[:-1] / scale[-1], squares / scale[-1] ** 2


def _solve_by_qr(gram: Gram, columns: _Columns) -> Solution:
    """Stack the triangular factor on each piece of the data and factor again: QR in the memory of one piece."""
    p = len(columns.scale) - 1
    triangle: np.ndarray = np.zeros((0, p + 1 + columns.with_constant))
    for lagged in _pieces(gram, columns):
        rows = np.stack(lagged, axis=1) / columns.scale
        if columns.with_constant:  # first, so that the rest of the triangle is free of it
            rows = np.hstack((np.ones((len(rows), 1)), rows))
        triangle = np.asarray(np.linalg.qr(np.vstack((triangle, rows)), mode="r"))
    first = int(columns.with_constant)
    triangle = triangle[first:, first:]
    left, singular, right = np.linalg.svd(triangle[:, :p], full_matrices=False)
    rank = int(np.sum(singular > singular[0] * max(gram.rows, p) * np.finfo(float).eps))
    pseudo = (right[:rank].T / singular[:rank]) @ left[:, :rank].T
    theta = pseudo @ triangle[:, p]
    residual = triangle[:, p] - triangle[:, :p] @ theta
    return _in_units(gram, columns, theta, pseudo @ pseudo.T, float(residual @ residual), rank)


def _pieces(gram: Gram, columns: _Columns):
    """Yield the lagged columns of each piece of the data as views."""
    for signals in gram.chunks():
        length = signals.shape[1]
        yield [
            signals[i, gram.max_lag - lag : length - lag] for i, lag in zip(columns.signal, columns.lag, strict=True)
        ]


def _constant(gram: Gram, columns: _Columns, coefficients: np.ndarray) -> float:
    if not columns.with_constant:
        return 0.0
    sums = gram.sums[columns.signal, columns.lag]
    return float(sums[-1] - coefficients @ sums[:-1]) / max(gram.rows, 1)


def _in_units(gram: Gram, columns: _Columns, theta, inverse, squares, rank) -> Solution:
    scale = columns.scale
    freedom = gram.rows - len(theta) - columns.with_constant
    variance = max(float(squares), 0.0) * scale[-1] ** 2 / max(freedom, 1)
    coefficients = theta * scale[-1] / scale[:-1]
    covariance = variance * inverse / scale[:-1] / scale[:-1, None]
    return Solution(coefficients, covariance, _constant(gram, columns, coefficients), variance, rank)
