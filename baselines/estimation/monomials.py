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
    u: Float[np.ndarray, "T nu"], y: Float[np.ndarray, "T ny"], lags: int, nk: int, differences: bool = False
) -> Float[np.ndarray, "n N"]:
    """Stack y(t-1) .. y(t-lags) of every output, then u(t-nk) .. u(t-lags) of every input, or their differences."""
    end, (past, _) = len(y), maps(lags, differences)
    of_y = np.array([y[lags - k : end - k].T for k in range(1, lags + 1)])  # [lags, ny, N]
    of_u = np.array([u[lags - k : end - k].T for k in range(nk, lags + 1)]).reshape(-1, u.shape[1], end - lags)
    if differences:
        of_y, of_u = (np.tensordot(past[: len(x), : len(x)], x, 1) for x in (of_y, of_u))
    return np.concatenate((of_y.reshape(-1, end - lags), of_u.reshape(-1, end - lags)))


def maps(lags: int, differences: bool) -> tuple[Float[np.ndarray, "L1 L1"], Float[np.ndarray, " lags"]]:
    """Give what makes regressors of past samples, newest first, and what makes of them the output without any term.

    Plain: 1 and 0. Differences: row k is the k-th difference, (1 - q^-1)^k, and the output follows from extrapolation.
    """
    past = np.eye(lags + 1)
    if not differences:
        return past, np.zeros(lags)
    for k in range(1, lags + 1):
        past[k] = past[k - 1] - np.append(0.0, past[k - 1, :-1])
    return past, past[:lags, :lags].sum(axis=0)


def started(
    u: Float[np.ndarray, "T nu"], y_init: Float[np.ndarray, "n ny"], lags: int
) -> tuple[Float[np.ndarray, "_ nu"], Float[np.ndarray, "_ ny"]]:
    """Give the inputs from `lags` samples before sample n on, and the outputs there.

    Where n is less than the lags, the first sample stood before the record.
    """
    missing, first = max(lags - len(y_init), 0), max(len(y_init) - lags, 0)
    longer = [np.concatenate((np.repeat(x[:1], missing, axis=0), x[first:])) for x in (u, y_init)]
    return longer[0], longer[1]
