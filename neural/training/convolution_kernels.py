"""Causal convolutions over time with ReLU, compiled: columns of shifted samples, one product, one bend."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, fastmath=True, error_model="numpy")
def run_conv(x, w, offset, dilation, columns, y):
    """y(k) = ReLU(offset + sum over j of W_j x(k - (K-1-j) dilation)); x [B, T, C], w [K C, G], zeros before the start.

    `columns` [B T, K C] is left for the backward pass.
    """
    batch, steps, channels = x.shape
    taps = columns.shape[1] // channels
    for b in range(batch):
        for t in range(steps):
            row = columns[b * steps + t]
            for j in range(taps):
                source = t - (taps - 1 - j) * dilation
                if source >= 0:
                    for c in range(channels):
                        row[j * channels + c] = x[b, source, c]
                else:
                    for c in range(channels):
                        row[j * channels + c] = 0
    flat = y.reshape(batch * steps, y.shape[2])
    np.dot(columns, w, flat)
    for row in range(flat.shape[0]):
        for g in range(flat.shape[1]):
            flat[row, g] = max(flat[row, g] + offset[g], 0)


@njit(cache=True, fastmath=True, error_model="numpy")
def back_conv(wt, y, dy, dilation, d, d_offset, dcolumns, dx):
    """Gradient before the bend in d [B T, G], its sum, and where dx has samples the gradients of columns and of x."""
    batch, steps, outputs = y.shape
    d_offset[:] = 0
    for b in range(batch):
        for t in range(steps):
            row = d[b * steps + t]
            for g in range(outputs):
                row[g] = dy[b, t, g] if y[b, t, g] > 0 else 0
                d_offset[g] += row[g]
    if dx.shape[1] == 0:
        return
    channels = dx.shape[2]
    taps = dcolumns.shape[1] // channels
    np.dot(d, wt, dcolumns)
    dx[:] = 0
    for b in range(batch):
        for t in range(steps):
            row = dcolumns[b * steps + t]
            for j in range(taps):
                source = t - (taps - 1 - j) * dilation
                if source >= 0:
                    for c in range(channels):
                        dx[b, source, c] += row[j * channels + c]
