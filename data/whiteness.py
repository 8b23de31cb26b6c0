"""Is an input white? The portmanteau test of Ljung and Box."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.fft import next_fast_len
from scipy.stats import chi2

LEVEL = 0.05  # of the test
LAGS = 20
ROUNDING = 1e-12  # of the largest value; an input that never moves still leaves rounding errors of its mean


def is_white(u: Float[np.ndarray, " T"]) -> bool:
    """Tell whether an input passes for white noise over lags 1 to 20, or as many as it has.

    A signal made by a hand, such as the gimbal's joystick, is not white, and need not be. Nor is an input that
    never moves.
    """
    if len(u) < 2 or np.abs(u - u.mean()).max() <= ROUNDING * np.abs(u).max():
        return False
    return ljung_box(u, min(LAGS, len(u) - 1)) >= LEVEL


def ljung_box(u: Float[np.ndarray, " T"], lags: int) -> float:
    """Compute how likely white noise is to have an autocorrelation as large as that of u, up to L = lags < T.

    r_k = sum_t (u_t - mean)(u_(t+k) - mean) / sum_t (u_t - mean)^2
    Q = T (T + 2) sum_(k=1..L) r_k^2 / (T - k),   chi-square with L degrees of freedom if u is white

    Reference: Ljung, Box, "On a measure of lack of fit in time series models", Biometrika 65 (1978) 297-303.
    """
    samples = len(u)
    padded = next_fast_len(samples + lags, real=True)
    covariance = np.fft.irfft(np.abs(np.fft.rfft(u - u.mean(), padded)) ** 2, padded)[: lags + 1]  # [L+1]
    r = covariance[1:] / covariance[0]  # [L]
    return float(chi2.sf(samples * (samples + 2) * np.sum(r**2 / (samples - np.arange(1, lags + 1))), lags))
