"""Autocorrelation of an error: how many samples count as one, and blocks that are longer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int
from scipy.fft import next_fast_len


def correlation_time(
    error: Float[np.ndarray, " N"], lengths: Sequence[int] | np.ndarray, removed: int
) -> tuple[float, int]:
    """Estimate how many samples count as one, and the lag at which the autocorrelation rho_k first reaches zero.

    tau = 1 + 2 sum_k rho_k over the lags k below that, at least 1. `removed` means were taken out of the error, which
    lowers every autocovariance by about removed tau / N of the variance; that is put back, because slow noise would
    look faster than it is. A record may be empty, where nothing of it was measured.
    """
    products, count = np.zeros(max(lengths)), np.zeros(max(lengths))  # per lag
    for part in filter(len, np.split(error, np.cumsum(lengths)[:-1])):
        n = len(part)
        padded = next_fast_len(2 * n, real=True)
        products[:n] += np.fft.irfft(np.abs(np.fft.rfft(part, padded)) ** 2, padded)[:n]
        count[:n] += n - np.arange(n)
    longest = max(2, int(max(lengths)) // 2)
    covariance = products[:longest] / count[:longest]
    if covariance[0] <= 0:
        return 1.0, 1
    tau, reach = 1.0, 1
    for _ in range(10):
        share = min(removed * tau / len(error), 0.9)
        rho = (covariance / covariance[0]) * (1 - share) + share
        reach = int(np.argmax(rho <= 0)) if np.any(rho <= 0) else len(rho)
        tau = max(1.0, 1 + 2 * float(rho[1:reach].sum()))
    return tau, reach


def blocks(error: Float[np.ndarray, " N"], experiment: Int[np.ndarray, " N"]) -> tuple[np.ndarray, np.ndarray]:
    """Cut each experiment into blocks longer than its correlation; return their mean squares and their experiments."""
    squared, lengths = error**2 / np.mean(error**2), np.bincount(experiment)
    reach = correlation_time(squared - means(squared, experiment), lengths, len(lengths))[1]
    whole = [part[: len(part) // (2 * reach) * 2 * reach] for part in np.split(squared, np.cumsum(lengths)[:-1])]
    sizes = [part.reshape(-1, 2 * reach).mean(axis=1) for part in whole]
    return np.concatenate(sizes), np.repeat(np.arange(len(sizes)), [len(part) for part in sizes])


def means(values: Float[np.ndarray, " N"], labels: Int[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    """Return for each sample the mean over the samples with the same label."""
    return (np.bincount(labels, values) / np.maximum(np.bincount(labels), 1))[labels]
