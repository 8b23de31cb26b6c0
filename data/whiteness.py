"""Is an input white? The test of the paper's section 2.4, with the right bounds and a verdict."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.fft import next_fast_len
from scipy.stats import chi2

from simgap.records import UnusableInput

LEVEL = 0.05  # of the test, and of the bounds


@dataclass(frozen=True, eq=False)
class Whiteness:
    """Autocorrelation of a signal of T samples, and how likely one as large is to come from white noise."""

    lags: Int[np.ndarray, " n"]  # 0 to L
    autocorrelation: Float[np.ndarray, " n"]  # 1 at lag 0
    bound: float  # 1.96/sqrt(T); at any one lag, white noise is within it 95 % of the time
    outside: int  # lags beyond the bound, of L
    expected: float  # the number of lags that white noise has beyond it
    statistic: float  # Ljung and Box's Q
    p_value: float

    @property
    def white(self) -> bool:
        """Whether the test lets whiteness stand."""
        return self.p_value >= LEVEL

    def text(self) -> str:
        """The verdict in one sentence."""
        p_value = f"= {self.p_value:.2g}" if self.p_value >= 0.001 else "< 0.001"
        counted = (
            f"{self.outside} of {self.lags[-1]} lags are outside ±{self.bound:.3f}, where white noise has "
            f"about {self.expected:.0f} (Ljung-Box p {p_value})"
        )
        if self.white:
            return f"The input passes for white noise: {counted}."
        return f"The input is not white: {counted}; its samples depend on those before them."


def whiteness(u: Float[np.ndarray, " T"], max_lag: int = 20) -> Whiteness:
    """Autocorrelation of u [T] up to lag L = max_lag, its 95 % bounds, and Ljung and Box's test of whiteness.

    r_k = sum_t (u_t - mean)(u_(t+k) - mean) / sum_t (u_t - mean)^2,   bounds ±1.96/sqrt(T)
    Q = T (T + 2) sum_(k=1..L) r_k^2 / (T - k),   chi-square with L degrees of freedom if u is white

    A signal made by a hand, such as the gimbal's joystick, is not white, and need not be. Raises
    UnusableInput for an input that never moves and for a record that is not longer than L.

    References: Box, Jenkins, "Time Series Analysis" (1970), chapter 8; Ljung, Box, "On a measure of lack of
    fit in time series models", Biometrika 65 (1978) 297-303.
    """
    samples = len(u)
    if not 1 <= max_lag < samples:
        raise UnusableInput(f"{samples} samples have no autocorrelation at lag {max_lag}; ask for 1 to T - 1")
    centred = u - u.mean()  # [T]
    # An input that never moves still leaves rounding errors of its mean.
    if np.abs(centred).max() <= 1e-12 * np.abs(u).max():
        raise UnusableInput("the input never moves, so it has no autocorrelation; excite the plant")
    spectrum = np.fft.rfft(centred, n=next_fast_len(samples + max_lag, real=True))
    covariance = np.fft.irfft(np.abs(spectrum) ** 2)[: max_lag + 1]  # [L+1]
    correlation = covariance / covariance[0]  # [L+1]
    lags = np.arange(max_lag + 1)
    bound = 1.96 / np.sqrt(samples)
    statistic = samples * (samples + 2) * np.sum(correlation[1:] ** 2 / (samples - lags[1:]))
    return Whiteness(
        lags=lags,
        autocorrelation=correlation,
        bound=float(bound),
        outside=int(np.sum(np.abs(correlation[1:]) > bound)),
        expected=LEVEL * max_lag,
        statistic=float(statistic),
        p_value=float(chi2.sf(statistic, max_lag)),
    )
