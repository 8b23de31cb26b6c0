"""Polynomials in the delay q^-1 applied to signals, from rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter


def multiply(b: np.ndarray | Sequence[float], signal: np.ndarray, axis: int = -1) -> np.ndarray:
    """Compute B(q) x: y(t) = sum_k b_k x(t-k)."""
    # The zero keeps SciPy from convolving row by row in Python, as it does without a denominator.
    return np.asarray(lfilter(b, [1.0, 0.0], signal, axis=axis))


def delayed(signal: np.ndarray, k: int) -> np.ndarray:
    """Compute q^-k x along the last axis: x(t-k), 0 before the record."""
    if k == 0:
        return signal
    out = np.zeros_like(signal)
    out[..., k:] = signal[..., :-k]
    return out


def divide(signal: np.ndarray, f: np.ndarray | Sequence[float], axis: int = -1) -> np.ndarray:
    """Compute x / F(q) with F monic: y(t) = x(t) - sum_k f_k y(t-k)."""
    if len(f) == 1:  # SciPy would convolve row by row in Python
        return np.array(signal)
    return np.asarray(lfilter([1.0], f, signal, axis=axis))
