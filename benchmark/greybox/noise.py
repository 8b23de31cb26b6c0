"""How likely errors are, when the measurement noise may be coloured."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.signal import lfilter

MAX_ORDER = 3
SINGULAR = 1e-13  # of the largest singular value of a matrix of products: below it is rounding


@dataclass(frozen=True, eq=False)
class Noise:
    """Autoregressive noise on each output: D(q) e = white of variance s^2, D monic [ny, order + 1]."""

    polynomials: Float[np.ndarray, "ny m"]
    deviations: Float[np.ndarray, " ny"]

    @property
    def order(self) -> int:
        """Past samples that the noise remembers."""
        return self.polynomials.shape[1] - 1

    def whiten(self, e: Float[np.ndarray, "... T ny"]) -> Float[np.ndarray, "... T ny"]:
        """Turn errors, or their slopes, into white noise of variance 1; the first samples count for nothing."""
        if not self.order:
            return e / self.deviations
        white = np.empty_like(e)
        for j, polynomial in enumerate(self.polynomials):
            white[..., j] = lfilter(polynomial / self.deviations[j], [1.0], e[..., j], axis=-1)
        white[..., : self.order, :] = 0.0
        return white


def white(deviations: Float[np.ndarray, " ny"]) -> Noise:
    """Describe noise without memory."""
    return Noise(np.ones((len(deviations), 1)), deviations)


def white_as_large_as(
    e: Float[np.ndarray, "E T ny"], mask: Bool[np.ndarray, "E T"], resolution: Float[np.ndarray, " ny"]
) -> Noise:
    """Describe noise without memory as large as these errors, and no smaller than what means anything."""
    return white(np.maximum(np.sqrt(np.mean(e[mask] ** 2, axis=0)), resolution))


def estimate(e: Float[np.ndarray, "E T ny"], mask: Bool[np.ndarray, "E T"], order: int) -> Noise:
    """Estimate the noise that errors e would be, by least squares (Ljung 1999, section 4.2).

    The Yule-Walker equations would take errors beyond a record for zero. Where a plant integrates, errors are large at
    its end: the noise would seem to have jumps, and whatever makes the errors smaller, a cause.
    """
    ny, samples = e.shape[2], e.shape[1]
    polynomials, deviations = np.zeros((ny, order + 1)), np.ones(ny)
    polynomials[:, 0] = 1.0
    lags = [slice(order - lag, max(samples, order) - lag) for lag in range(order + 1)]
    known = np.logical_and.reduce([mask[:, lag] for lag in lags])
    for j in range(ny):
        lagged = np.array([e[:, lag, j][known] for lag in lags])  # [1 + order, N]
        products = lagged @ lagged.T / max(1, lagged.shape[1])
        if order and products[0, 0] > 0 and np.isfinite(products).all():
            polynomials[j, 1:] = -np.linalg.lstsq(products[1:, 1:], products[1:, 0], rcond=SINGULAR)[0]
        if total := products[0, 0]:  # noise that its past explains altogether is still noise; none has any deviation
            deviations[j] = np.sqrt(max(polynomials[j] @ products @ polynomials[j], 1e-12 * total))
    return Noise(polynomials, deviations)


def schwarz_order(
    e: Float[np.ndarray, "E T ny"], mask: Bool[np.ndarray, "E T"], resolution: float | np.ndarray = 0.0
) -> int:
    """Choose the memory of errors e by Schwarz' criterion (Schwarz 1978), with the same samples for every order."""
    n = int(mask[:, MAX_ORDER:].sum())
    if not n:
        return 0  # records that short tell nothing of a memory
    price = 0.5 * e.shape[2] * math.log(n)
    likelihoods = [log_likelihood(e, mask, order, resolution, MAX_ORDER) for order in range(MAX_ORDER + 1)]
    return int(np.argmax([likelihood - order * price for order, likelihood in enumerate(likelihoods)]))


def explained_by_past(e: Float[np.ndarray, "E T ny"], mask: Bool[np.ndarray, "E T"]) -> float:
    """Compute the share of the squares of errors e that the errors before them explain, the mean over the outputs."""
    total = np.mean(e[mask] ** 2, axis=0)
    if not (np.isfinite(total) & (total > 0)).all():
        return 0.0
    return float(np.mean(1.0 - estimate(e, mask, MAX_ORDER).deviations ** 2 / total))


def log_likelihood(
    e: Float[np.ndarray, "E T ny"],
    mask: Bool[np.ndarray, "E T"],
    order: int,
    resolution: float | np.ndarray = 0.0,
    skipped: int | None = None,
) -> float:
    """Compute the log-likelihood of errors e under the noise of that order that suits them best, up to a constant.

    The first samples of each record are not counted: `skipped` of them, else as many as the noise remembers. Orders
    are compared on the same samples only, because the unit of e enters once for every sample. `resolution` is the
    smallest spread of each output that may count as likely, so that of two perfect fits none is the better one.
    """
    noise = estimate(e, mask, order)
    if not np.isfinite(noise.deviations).all():
        return -np.inf
    counted = mask.copy()
    counted[:, : order if skipped is None else skipped] = False
    if not counted.any():
        return 0.0
    w = noise.whiten(e)[counted] * noise.deviations  # [N, ny]
    variance = np.maximum(np.mean(w * w, axis=0), np.square(resolution))
    return float(-0.5 * counted.sum() * np.sum(np.log(np.maximum(variance, np.finfo(float).tiny))))
