"""Products of past outputs and inputs."""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np
from jaxtyping import Float, Int


def monomials(regressors: int, degree: int) -> Int[np.ndarray, "p d"]:
    """List all products of up to `degree` of the regressors 1 .. n; a row holds their numbers, 0 stands for 1."""
    return np.array(list(combinations_with_replacement(range(regressors + 1), degree)))


def values(r: Float[np.ndarray, "n T"], terms: Int[np.ndarray, "p d"]) -> Float[np.ndarray, "p T"]:
    """Evaluate products of regressors."""
    with_one = np.concatenate((np.ones((1, r.shape[1])), r))
    product = with_one[terms[:, 0]]
    for k in range(1, terms.shape[1]):
        product = product * with_one[terms[:, k]]
    return product


def regressors(
    u: Float[np.ndarray, "T nu"], y: Float[np.ndarray, "T ny"], lags: int, nk: int
) -> Float[np.ndarray, "n N"]:
    """Stack y(t-1) .. y(t-lags) of every output, then u(t-nk) .. u(t-lags) of every input."""
    end = len(y)
    rows = [y[lags - k : end - k, i] for k in range(1, lags + 1) for i in range(y.shape[1])]
    rows += [u[lags - k : end - k, j] for k in range(nk, lags + 1) for j in range(u.shape[1])]
    return np.array(rows)
