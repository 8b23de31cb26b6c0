"""Finite impulse responses under a prior that says they are smooth and decay, its numbers by empirical Bayes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import block_diag, cho_solve, cholesky
from scipy.optimize import minimize

from simgap.baselines.estimation.equation_error import assemble, check_length, coefficient_names
from simgap.baselines.estimation.fitted import LinearFit, Row
from simgap.baselines.estimation.gram import Gram
from simgap.baselines.estimation.orders import Orders
from simgap.cores import one_thread

Kernel = Callable[[int, float], np.ndarray]


def tuned_correlated(length: int, decay: float) -> Float[np.ndarray, "L L"]:
    """Compute P_ij = decay^max(i, j) (TC: Chen, Ohlsson and Ljung 2012, eq. 21)."""
    k = np.arange(1, length + 1)
    return decay ** np.maximum.outer(k, k)


def stable_spline(length: int, decay: float) -> Float[np.ndarray, "L L"]:
    """Compute P_ij = decay^(i + j + max) / 2 - decay^(3 max) / 6 (SS: Pillonetto and De Nicolao 2010)."""
    k = np.arange(1, length + 1)
    most = np.maximum.outer(k, k)
    return decay ** (np.add.outer(k, k) + most) / 2 - decay ** (3.0 * most) / 6


DECAYS = 12  # time constants that are tried
# Of the trace of L' S L: less noise is lost in the rounding of S, where an input has no power at most frequencies.
LEAST_NOISE = 1e-13
OPTIONS = {"maxfev": 60, "xatol": 0.03, "fatol": 0.03}
KERNELS: dict[str, Kernel] = {"tc": tuned_correlated, "ss": stable_spline}


def estimate_regularised(gram: Gram, orders: Orders) -> LinearFit:
    """Estimate y = B(q) u + constant + e, the response to each input normal with its own scale and decay.

    Those and the noise variance maximise the marginal likelihood, the larger one of the two kernels; the coefficients
    are the posterior mean. Raises TooFewSamples when no equation is left.
    """
    ny = len(orders.nb)
    means = gram.sums / max(gram.rows, 1)
    products = gram.products / max(gram.rows, 1) - np.multiply.outer(means, means)
    rows, constants = [], np.zeros(ny)
    for i in range(ny):
        regressors = orders.lagged(i)
        check_length(gram.rows, 2 * len(orders.nb[i]) + 1, gram.max_lag)
        at = tuple(np.array(regressors).T)
        phi = products[at[0][:, None], at[1][:, None], at[0], at[1]]
        target = products[(*at, i, 0)]
        power, lengths = float(products[i, 0, i, 0]), tuple(int(n) for n in orders.nb[i] if n)
        problem = _Evidence(phi, target, power, gram.rows, lengths)
        with one_thread():
            theta, covariance, variance = min((problem.best(kernel) for kernel in KERNELS.values()), key=_minus_log)[1]
        constants[i] = means[i, 0] - theta @ means[at]
        names = coefficient_names(regressors, ny, orders.nb.shape[1])
        rows.append(Row(names, theta, covariance, variance, len(theta)))
    return assemble(gram, orders, tuple(rows), constants, [np.ones(1)] * ny)


@dataclass(frozen=True, eq=False)
class _Evidence:
    """Mean products of centred signals: phi of the regressors, target with the output, power of the output."""

    phi: Float[np.ndarray, "p p"]
    target: Float[np.ndarray, " p"]
    power: float
    rows: int
    lengths: tuple[int, ...]

    def best(self, kernel: Kernel) -> tuple[float, tuple[np.ndarray, np.ndarray, float]]:
        """Maximise the likelihood: minus twice its logarithm, and there theta, its covariance, the noise variance.

        The decay, the same for all inputs, is searched on a grid; the noise and a scale per input by Nelder-Mead.
        """
        x = np.append(np.log(0.1), np.zeros(len(self.lengths)))
        found = []
        for constant in max(self.lengths) * np.geomspace(0.5, 0.01, DECAYS):
            likelihood = self._likelihood(kernel, np.exp(-1 / constant))
            x = minimize(lambda x, of=likelihood: of(x)[0], x, method="Nelder-Mead", options=OPTIONS).x
            found.append((likelihood(x)[0], likelihood, x))
        _, likelihood, x = min(found, key=lambda of: of[0])
        minus_log, root, factor, weights, s2 = likelihood(x)
        return minus_log, (root @ weights, s2 * root @ cho_solve((factor, True), root.T), s2)

    def _likelihood(self, kernel: Kernel, decay: float) -> Callable[[np.ndarray], tuple]:
        """Give -2 log p(y | x) and what it was computed from, for x = log noise over power, log scale of each input.

        With P = L L' and S = phi N: N log s2 + log det(I + L' S L / s2) + (y'y - F' L (s2 + L' S L)^-1 L' F) / s2
        (Chen and Ljung, Automatica 49, 2013, eq. 9).
        """
        roots = [_root(kernel(length, decay)) for length in self.lengths]
        root, n = block_diag(*roots), self.rows
        which = np.repeat(np.arange(len(roots)), [part.shape[1] for part in roots])
        inner, right = root.T @ self.phi @ root * n, n * root.T @ self.target
        power = self.power or 1.0
        unit = power / max(float(np.trace(self.phi)) / len(self.phi), 1e-300)

        def at(x: np.ndarray) -> tuple:
            s2 = float(power * np.exp(np.clip(x[0], -30, 5)))
            size = np.sqrt(unit * np.exp(np.clip(x[1:], -30, 30)))[which]
            scaled = inner * np.outer(size, size)
            s2 = max(s2, LEAST_NOISE * float(np.trace(scaled)))
            factor = cholesky(scaled + s2 * np.eye(len(size)), lower=True)
            weights = cho_solve((factor, True), size * right)
            log_det = 2 * np.sum(np.log(np.diag(factor))) - len(size) * np.log(s2)
            minus_log = n * np.log(s2) + log_det + (n * self.power - (size * right) @ weights) / s2
            return float(minus_log), root * size, factor, weights, s2

        return at


def _root(prior: np.ndarray) -> np.ndarray:
    """Factor a prior into L L'; what is smaller than rounding is left out."""
    values, vectors = np.linalg.eigh(prior)
    kept = values > 1e-10 * values[-1]
    return vectors[:, kept] * np.sqrt(values[kept])


def _minus_log(found: tuple[float, tuple]) -> float:
    return found[0]
