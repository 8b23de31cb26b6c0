"""Weights of several simulations in their mean, and what the mean errs by where none of its weights was estimated."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.optimize import nnls

from simgap.error_views.correlation import correlation_time
from simgap.records import UnusableInput

PIECES = 10  # of the data, each judged by weights of the rest


def stacked(
    models: Sequence[str], runs: Float[np.ndarray, "M N ny"], target: Float[np.ndarray, "N ny"]
) -> Float[np.ndarray, " M"]:
    """Weigh free runs of models, some of which have several; raises UnusableInput where all of them diverge."""
    with np.errstate(over="ignore", invalid="ignore"):
        errors = np.square(runs - target).mean(axis=(1, 2))
    finite = np.isfinite(errors)
    if not finite.any():
        raise UnusableInput("no member of the ensemble simulates the validation data")
    worth = np.where(finite, 1 / np.maximum(errors, 1e-30), 0.0)
    named = np.array([[name == model for name in models] for model in dict.fromkeys(models)]) & finite  # [K, M]
    within = named[named.any(axis=1)] * worth
    within /= within.sum(axis=1, keepdims=True)
    means = np.tensordot(within, np.where(finite[:, None, None], runs, 0.0), 1).reshape(len(within), -1)
    # Of sum w = 1 and the least squares, the first holds to a millionth, and then exactly.
    much = 1e3 * (np.abs(means).max() or 1.0) * np.sqrt(target.size)
    shares, _ = nnls(np.vstack((means.T, np.full(len(within), much))), np.append(target.ravel(), much))
    return shares / shares.sum() @ within


def cross_validated(
    models: Sequence[str], runs: Float[np.ndarray, "M N ny"], target: Float[np.ndarray, "N ny"]
) -> float:
    """Compute the RMS error of the mean, each piece of the data weighed by the rest, for `runs` over their sizes.

    The rest is what lies further off than errors remember: samples beside the piece would tell its errors (Burman,
    Chow and Nolan, A cross-validatory method for dependent data, Biometrika 81, 1994). Without a rest all models are
    worth the same. Raises UnusableInput as `stacked` does.
    """
    finite = [i for i, run in enumerate(runs) if np.isfinite(run).all()]
    models, runs = [models[i] for i in finite], runs[finite]
    error = np.tensordot(stacked(models, runs, target), runs, 1) - target
    memory = max(correlation_time(of_output, [len(error)], 0)[0] for of_output in error.T)
    at = np.arange(len(target))
    for piece in np.array_split(at, min(PIECES, len(at))):
        far = (at < piece[0] - memory) | (at > piece[-1] + memory)
        of_rest = stacked(models, runs[:, far], target[far]) if far.any() else np.full(len(runs), 1 / len(runs))
        error[piece] = np.tensordot(of_rest, runs[:, piece], 1) - target[piece]
    return math.sqrt(np.mean(np.square(error)))
