"""Regression with a Gaussian kernel at chosen centres, its prior weight varied at no cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import solve_triangular

from simgap.baselines.estimation.kernel_narx_kernels import run_free
from simgap.baselines.estimation.monomials import regressors, started
from simgap.records import Experiment

CHUNK = 8192
LINEAR = 10.0  # prior standard deviation of the linear part, that of the kernel part being 1
TOLERANCE = 1e-9  # of the prior variance: a point that the centres explain so well adds nothing


@dataclass(frozen=True, eq=False)
class KernelNarx:
    """y(t) = linear (1, r(t)) + sum_k w_k exp(-gamma |r(t) - c_k|^2), r the past outputs and inputs, all scaled.

    Signals are to their scale, (y - mean) / size.
    """

    centres: Float[np.ndarray, "m n"]
    weights: Float[np.ndarray, "m ny"]
    linear: Float[np.ndarray, "n1 ny"]
    gamma: float
    lags: int
    nk: int
    means: tuple[Float[np.ndarray, " nu"], Float[np.ndarray, " ny"]]
    sizes: tuple[Float[np.ndarray, " nu"], Float[np.ndarray, " ny"]]
    bound: float

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Run free after n measured samples."""
        u, y_init = (u - self.means[0]) / self.sizes[0], (y_init - self.means[1]) / self.sizes[1]
        runs = [self.run(*started(one, start, self.lags)) for one, start in zip(u, y_init, strict=True)]
        return np.array(runs).reshape(len(u), u.shape[1] - y_init.shape[1], -1) * self.sizes[1] + self.means[1]

    def run(self, u: Float[np.ndarray, "T nu"], before: Float[np.ndarray, "N ny"]) -> Float[np.ndarray, "T-N ny"]:
        """Run free from the outputs `before`, scaled; u begins with them."""
        y = np.zeros((len(u), before.shape[1]))
        y[: self.lags] = before
        run_free(
            np.ascontiguousarray(u), y, self.lags, self.nk, self.centres, self.weights, self.linear, self.gamma,
            self.bound,
        )  # fmt: skip
        return y[self.lags :]


@dataclass(frozen=True, eq=False)
class Regression:
    """Least squares on the kernel features of chosen centres, for any weight of the prior.

    The features Phi are k(r, C) L^-T with k(C, C) = L L', so that their prior is white: the posterior mean of a
    Gaussian process on a subset of regressors (Rasmussen and Williams 2006, section 8.3.1). From the singular values of
    Phi, by QR, because rounding in Phi' Phi is as large as a small ridge (Foster et al., J. Machine Learning Research
    10, 2009).
    """

    centres: Float[np.ndarray, "m n"]
    root: Float[np.ndarray, "m m"]
    gamma: float
    vectors: Float[np.ndarray, "p s"]
    values: Float[np.ndarray, " s"]
    right: Float[np.ndarray, "s ny"]

    @classmethod
    def of(
        cls, r: Float[np.ndarray, "N n"], y: Float[np.ndarray, "N ny"], gamma: float, most: int, pool: int
    ) -> Regression:
        """Choose up to `most` centres among `pool` rows that lie evenly in the record, and sum up the products."""
        candidates = r[np.linspace(0, len(r) - 1, min(pool, len(r))).astype(int)]
        chosen, root = pivoted_cholesky(candidates, gamma, most)
        centres = candidates[chosen]
        triangle = np.zeros((0, r.shape[1] + 1 + len(centres) + y.shape[1]))
        for at in range(0, len(r), CHUNK):
            phi = _features(r[at : at + CHUNK], centres, root, gamma)
            both = np.concatenate((phi, y[at : at + CHUNK]), axis=1)
            triangle = np.asarray(np.linalg.qr(np.concatenate((triangle, both)), mode="r"))
        of_phi, of_y = np.split(triangle, [triangle.shape[1] - y.shape[1]], axis=1)
        left, values, vectors = np.linalg.svd(of_phi, full_matrices=False)
        return cls(centres, root, gamma, vectors.T, values, left.T @ of_y)

    def solution(self, ridge: float) -> tuple[Float[np.ndarray, "n1 ny"], Float[np.ndarray, "m ny"]]:
        """Compute the linear part and the weights of the kernels; ridge is the noise variance over the prior's."""
        beta = self.vectors @ (self.right * (self.values / (self.values**2 + ridge))[:, None])
        first = self.centres.shape[1] + 1
        weights = solve_triangular(self.root.T, beta[first:])
        return np.ascontiguousarray(LINEAR * beta[:first]), np.ascontiguousarray(weights)


def pivoted_cholesky(
    r: Float[np.ndarray, "N n"], gamma: float, most: int
) -> tuple[np.ndarray, Float[np.ndarray, "m m"]]:
    """Choose rows one by one, always the one the chosen explain least, and factor their kernel matrix.

    Incomplete Cholesky factorisation with pivots (Fine and Scheinberg 2001).
    """
    left, columns, chosen = np.ones(len(r)), np.zeros((min(most, len(r)), len(r))), []
    for k in range(len(columns)):
        best = int(np.argmax(left))
        if left[best] < TOLERANCE:
            break
        chosen.append(best)
        column = np.exp(-gamma * np.sum((r - r[best]) ** 2, axis=1)) - columns[:k, best] @ columns[:k]
        columns[k] = column / np.sqrt(left[best])
        left = np.maximum(left - columns[k] ** 2, 0.0)
        left[chosen] = 0.0
    return np.array(chosen), np.tril(columns[: len(chosen), chosen].T)


def stacked(
    records: Sequence[tuple[np.ndarray, np.ndarray]], lags: int, nk: int
) -> tuple[Float[np.ndarray, "N n"], Float[np.ndarray, "N ny"]]:
    """Stack regressors and outputs of scaled records u, y that are longer than the lags."""
    long_enough = [(u, y) for u, y in records if len(y) > lags]
    rows = [regressors(u, y, lags, nk).T for u, y in long_enough]
    return np.concatenate(rows), np.concatenate([y[lags:] for _, y in long_enough])


def scaled(
    experiments: Sequence[Experiment], means: tuple[np.ndarray, np.ndarray], sizes: tuple[np.ndarray, np.ndarray]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Take u and y of experiments to the scale of a model."""
    return [((e.u - means[0]) / sizes[0], (e.y - means[1]) / sizes[1]) for e in experiments]


def _features(r: np.ndarray, centres: np.ndarray, root: np.ndarray, gamma: float) -> Float[np.ndarray, "N p"]:
    squares = np.sum(r**2, axis=1)[:, None] + np.sum(centres**2, axis=1) - 2 * r @ centres.T
    kernel = np.exp(-gamma * np.maximum(squares, 0.0))
    white = solve_triangular(root, kernel.T, lower=True).T
    return np.concatenate((np.full((len(r), 1), LINEAR), LINEAR * r, white), axis=1)
