"""Sums of products of lagged signals: all that least squares needs to know of the data.

For signals x_1..x_S (outputs first, then inputs) the Gram matrix holds sum_t x_i(t-k) x_j(t-l) for every pair of
lags. Its diagonals are shifts of each other, so S^2 (L+1) dot products replace the (S (L+1))^2 of the full matrix:

    G[i, k+1, j, l+1] = G[i, k, j, l] + x_i(s-1-k) x_j(s-1-l) - x_i(T-1-k) x_j(T-1-l),   sums over t = s .. T-1

the "covariance method" and its displacement structure (Morf, Dickinson, Kailath and Vieira 1977).
The regressor matrix is never built, so the memory does not grow with the record.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simgap.records import Experiment

# So many float64 samples of a few signals stay in a processor's second-level cache, and OpenBLAS does not split a
# dot product of fewer than 10,000 over threads, whose hand-over costs more than the product.
CHUNK = 8192


@dataclass(frozen=True, eq=False)
class Gram:
    """products [S, L+1, S, L+1] and sums [S, L+1] over `rows` samples of the signals less `shift`.

    Made of the same experiments that `chunks` reads again where a solution has to be refined.
    """

    experiments: tuple[Experiment, ...]
    shift: Float[np.ndarray, " S"]
    products: Float[np.ndarray, "S L1 S L1"]
    sums: Float[np.ndarray, "S L1"]
    rows: int

    @property
    def max_lag(self) -> int:
        """L, the largest lag; every sum starts at sample L of its experiment."""
        return self.products.shape[1] - 1

    @property
    def spread(self) -> Float[np.ndarray, " S"]:
        """The root mean square of each signal about its shift, 1 for one that never moves."""
        squares = np.einsum("iaia->ia", self.products)[:, 0] / max(self.rows, 1)
        return np.sqrt(np.where(squares > 0, squares, 1.0))

    def chunks(self) -> Iterator[Float[np.ndarray, "S n"]]:
        """Yield the shifted signals in pieces, each with the L samples before it, in one buffer for all."""
        for experiment in self.experiments:
            yield from _chunks(experiment, self.shift, self.max_lag)


def rough_means(experiments: Sequence[Experiment], offset: bool = True) -> Float[np.ndarray, " S"]:
    """Estimate the mean of each signal from a thousand samples at most; zero for a model without offset.

    A rough mean will do: it keeps the squares small, and the constant of the model absorbs what it is off exactly.
    """
    if not offset:
        return np.zeros(experiments[0].y.shape[1] + experiments[0].u.shape[1])
    step = max(1, sum(map(len, experiments)) // 1000)
    return np.concatenate([np.hstack((e.y[::step], e.u[::step])) for e in experiments]).mean(axis=0)


def lagged_gram(experiments: Sequence[Experiment], shift: Float[np.ndarray, " S"], max_lag: int) -> Gram:
    """Accumulate the products of all lags 0..max_lag over every experiment, each on its own."""
    count, lags = len(shift), max_lag + 1
    first, first_sum = np.zeros((count, count, lags)), np.zeros(count)  # [i, j, l]: sum_t x_i(t) x_j(t-l)
    long_enough = tuple(experiment for experiment in experiments if len(experiment) > max_lag)
    for experiment in long_enough:
        for signals in _chunks(experiment, shift, max_lag):
            first_sum += signals[:, max_lag:].sum(axis=1)
            for i in range(count):
                for j in range(count):
                    first[i, j] += np.correlate(signals[j], signals[i, max_lag:], "valid")[::-1]
    edges = np.zeros((2, len(long_enough), count, max_lag))
    for e, experiment in enumerate(long_enough):
        edges[:, e] = _edges(experiment, shift, max_lag)
    sums = first_sum[:, None] + np.zeros(lags)
    sums[:, 1:] += np.cumsum((edges[0] - edges[1]).sum(axis=0), axis=1)
    rows = sum(len(experiment) - max_lag for experiment in long_enough)
    return Gram(long_enough, shift, _shift_down(first, *edges), sums, rows)


def _chunks(experiment: Experiment, shift: Float[np.ndarray, " S"], max_lag: int) -> Iterator[np.ndarray]:
    outputs = experiment.y.shape[1]
    # One buffer for all pieces: a fresh one each time would cost more in page faults than the products do.
    buffer = np.empty((len(shift), min(CHUNK + max_lag, len(experiment))))
    for start in range(max_lag, len(experiment), CHUNK):
        piece = slice(start - max_lag, min(start + CHUNK, len(experiment)))
        signals = buffer[:, : piece.stop - piece.start]
        np.subtract(experiment.y[piece].T, shift[:outputs, None], out=signals[:outputs])
        np.subtract(experiment.u[piece].T, shift[outputs:, None], out=signals[outputs:])
        yield signals


def _edges(
    experiment: Experiment, shift: Float[np.ndarray, " S"], max_lag: int
) -> tuple[Float[np.ndarray, "S L"], Float[np.ndarray, "S L"]]:
    """Give head[i, k] = x_i(L-1-k), which enters a sum as its lag grows by one, and tail[i, k] = x_i(T-1-k), which
    leaves it.
    """
    length = len(experiment)
    head, tail = (
        (np.hstack((experiment.y[part], experiment.u[part])) - shift)[::-1].T
        for part in (slice(max_lag), slice(length - max_lag, length))
    )
    return head, tail


def _shift_down(
    first: Float[np.ndarray, "S S L1"], heads: Float[np.ndarray, "E S L"], tails: Float[np.ndarray, "E S L"]
) -> Float[np.ndarray, "S L1 S L1"]:
    """Recur from the products with lag 0 to those of all lags, by the edges of all experiments."""
    count, _, lags = first.shape
    products = np.empty((count, lags, count, lags))
    products[:, 0] = first
    products[:, :, :, 0] = first.transpose(1, 2, 0)
    for k in range(lags - 1):
        change = np.tensordot(heads[:, :, k], heads, axes=(0, 0))  # [S, S, L]
        change -= np.tensordot(tails[:, :, k], tails, axes=(0, 0))
        products[:, k + 1, :, 1:] = products[:, k, :, :-1] + change
    return products
