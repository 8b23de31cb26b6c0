"""Causal convolutions over time with ReLU, compiled: shifted samples side by side, one product, one bend.

Arrays are x [B, T, C], weights [G, C, K] as in PyTorch, y [B, T, G]; tap K-1 meets the newest sample.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, fastmath=True, error_model="numpy")
def _by_taps(weight):
    """Weights [G, C, K] as a matrix [G, K C]."""
    outputs, channels, taps = weight.shape
    flat = np.empty((outputs, taps * channels), weight.dtype)
    for g in range(outputs):
        for c in range(channels):
            for j in range(taps):
                flat[g, j * channels + c] = weight[g, c, j]
    return flat


@njit(cache=True, fastmath=True, error_model="numpy")
def _unshift(columns, dilation, x):
    """The sum of what was taken from every sample of x."""
    batch, steps, channels = x.shape
    taps = columns.shape[1] // channels
    x[:] = 0
    for b in range(batch):
        for t in range(steps):
            row = columns[b * steps + t]
            for j in range(taps):
                source = t - (taps - 1 - j) * dilation
                if source >= 0:
                    for c in range(channels):
                        x[b, source, c] += row[j * channels + c]


@njit(cache=True, fastmath=True, error_model="numpy")
def run_conv(x, weight, offset, dilation, columns, y):
    """y(k) = ReLU(offset + sum over j of W_j x(k - (K-1-j) dilation)), zeros before the start.

    `columns` [B T, K C] is left for the backward pass.
    """
    batch, steps, channels = x.shape
    outputs, _, taps = weight.shape
    flat = _by_taps(weight)
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
    values = y.reshape(batch * steps, outputs)
    np.dot(columns, flat.T, values)
    for row in range(batch * steps):
        for g in range(outputs):
            values[row, g] = max(values[row, g] + offset[g], 0)


@njit(cache=True, fastmath=True, error_model="numpy")
def back_conv(weight, columns, y, dy, dilation, d_weight, d_offset, dx):
    """Gradients of the weights, of the offset and, where dx has samples, of x."""
    batch, steps, outputs = y.shape
    _, channels, taps = weight.shape
    d = np.empty((batch * steps, outputs), y.dtype)
    d_offset[:] = 0
    for b in range(batch):
        for t in range(steps):
            row = d[b * steps + t]
            for g in range(outputs):
                row[g] = dy[b, t, g] if y[b, t, g] > 0 else 0
                d_offset[g] += row[g]
    of_columns = np.dot(d.T, columns)  # [G, K C]
    for g in range(outputs):
        for c in range(channels):
            for j in range(taps):
                d_weight[g, c, j] = of_columns[g, j * channels + c]
    if dx.shape[1] > 0:
        _unshift(np.dot(d, _by_taps(weight)), dilation, dx)


@njit(cache=True, fastmath=True, error_model="numpy")
def run_block(x, step, w1, o1, w2, o2, skip, skip_offset, dilation, kept, columns1, y1, columns2, y2, y):
    """y = ReLU(conv(conv(x)) + skip x) on every `step`-th sample of x counted from the end, which are left in `kept`.

    An empty `skip` is the identity.
    """
    batch, steps, channels = kept.shape
    first = x.shape[1] - 1 - (steps - 1) * step
    for b in range(batch):
        for t in range(steps):
            for c in range(channels):
                kept[b, t, c] = x[b, first + t * step, c]
    run_conv(kept, w1, o1, dilation, columns1, y1)
    run_conv(y1, w2, o2, dilation, columns2, y2)
    if skip.shape[0]:
        around = np.dot(kept.reshape(batch * steps, channels), skip.T).reshape(y.shape)
        for b in range(batch):
            for t in range(steps):
                for g in range(y.shape[2]):
                    y[b, t, g] = max(y2[b, t, g] + around[b, t, g] + skip_offset[g], 0)
    else:
        for b in range(batch):
            for t in range(steps):
                for g in range(y.shape[2]):
                    y[b, t, g] = max(y2[b, t, g] + kept[b, t, g], 0)


@njit(cache=True, fastmath=True, error_model="numpy")
def back_block(
    step, w1, w2, skip, dilation, kept, columns1, y1, columns2, y2, y, dy, dw1, do1, dw2, do2, d_skip, do_skip, dx
):
    """Backward pass of `run_block`; without samples in dx its gradient is left out."""
    batch, steps, outputs = y.shape
    channels = kept.shape[2]
    d, dy1 = np.empty_like(y), np.empty_like(y1)
    for b in range(batch):
        for t in range(steps):
            for g in range(outputs):
                d[b, t, g] = dy[b, t, g] if y[b, t, g] > 0 else 0
    back_conv(w2, columns2, y2, d, dilation, dw2, do2, dy1)
    wanted = dx.shape[1] > 0
    d_kept = np.empty((batch, steps if wanted else 0, channels), y.dtype)
    back_conv(w1, columns1, y1, dy1, dilation, dw1, do1, d_kept)
    flat = d.reshape(batch * steps, outputs)
    if skip.shape[0]:
        d_skip[:] = np.dot(flat.T, kept.reshape(batch * steps, channels))
        do_skip[:] = 0
        for row in range(batch * steps):
            for g in range(outputs):
                do_skip[g] += flat[row, g]
    if not wanted:
        return
    around = np.dot(flat, skip).reshape(d_kept.shape) if skip.shape[0] else d
    first = dx.shape[1] - 1 - (steps - 1) * step
    dx[:] = 0
    for b in range(batch):
        for t in range(steps):
            for c in range(channels):
                dx[b, first + t * step, c] = d_kept[b, t, c] + around[b, t, c]


@njit(cache=True, fastmath=True, error_model="numpy")
def run_pooled(x, weight, offset, columns, y, mean):
    """`run_conv`, and the mean of each two samples."""
    run_conv(x, weight, offset, 1, columns, y)
    for b in range(mean.shape[0]):
        for t in range(mean.shape[1]):
            for g in range(mean.shape[2]):
                mean[b, t, g] = (y[b, 2 * t, g] + y[b, 2 * t + 1, g]) / 2


@njit(cache=True, fastmath=True, error_model="numpy")
def back_pooled(weight, columns, y, d_mean, d_weight, d_offset, dx):
    """Backward pass of `run_pooled`."""
    dy = np.empty_like(y)
    for b in range(d_mean.shape[0]):
        for t in range(d_mean.shape[1]):
            for g in range(d_mean.shape[2]):
                dy[b, 2 * t, g] = dy[b, 2 * t + 1, g] = d_mean[b, t, g] / 2
    back_conv(weight, columns, y, dy, 1, d_weight, d_offset, dx)
