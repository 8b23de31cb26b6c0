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
def _unshift(columns, dilation, step, x):
    """The sum of what was taken from every sample of x."""
    batch, steps, channels = x.shape
    taps = columns.shape[1] // channels
    answers = columns.shape[0] // batch
    first = steps - 1 - (answers - 1) * step - (taps - 1) * dilation
    flat = x.reshape(batch, steps * channels)
    x[:] = 0
    for b in range(batch):
        for s in range(answers):
            row = columns[b * answers + s]
            start = first + s * step
            if dilation == 1 and start >= 0:  # the taps lie side by side
                for i in range(taps * channels):
                    flat[b, start * channels + i] += row[i]
                continue
            for j in range(taps):
                source = start + j * dilation
                if source >= 0:
                    for c in range(channels):
                        x[b, source, c] += row[j * channels + c]


@njit(cache=True, fastmath=True, error_model="numpy")
def run_conv(x, weight, offset, dilation, step, columns, y):
    """y(k) = ReLU(offset + sum over j of W_j x(k - (K-1-j) dilation)), zeros before the start.

    Only every `step`-th sample counted from the end is computed, as many as y has. `columns` [B T, K C] is left for
    the backward pass.
    """
    batch, steps, channels = x.shape
    outputs, _, taps = weight.shape
    answers = y.shape[1]
    first = steps - 1 - (answers - 1) * step - (taps - 1) * dilation
    flat = x.reshape(batch, steps * channels)
    for b in range(batch):
        for s in range(answers):
            row = columns[b * answers + s]
            start = first + s * step
            if dilation == 1 and start >= 0:  # the taps lie side by side
                for i in range(taps * channels):
                    row[i] = flat[b, start * channels + i]
                continue
            for j in range(taps):
                source = start + j * dilation
                if source >= 0:
                    for c in range(channels):
                        row[j * channels + c] = x[b, source, c]
                else:
                    for c in range(channels):
                        row[j * channels + c] = 0
    values = y.reshape(batch * answers, outputs)
    np.dot(columns, _by_taps(weight).T, values)
    for row in range(batch * answers):
        for g in range(outputs):
            values[row, g] = max(values[row, g] + offset[g], 0)


@njit(cache=True, fastmath=True, error_model="numpy")
def back_conv(weight, columns, y, dy, dilation, step, d_weight, d_offset, dx):
    """Gradients of the weights, of the offset and, where dx has samples, of x."""
    batch, answers, outputs = y.shape
    _, channels, taps = weight.shape
    d = np.empty((batch * answers, outputs), y.dtype)
    d_offset[:] = 0
    for b in range(batch):
        for s in range(answers):
            row = d[b * answers + s]
            for g in range(outputs):
                row[g] = dy[b, s, g] if y[b, s, g] > 0 else 0
                d_offset[g] += row[g]
    of_columns = np.dot(d.T, columns)  # [G, K C]
    for g in range(outputs):
        for c in range(channels):
            for j in range(taps):
                d_weight[g, c, j] = of_columns[g, j * channels + c]
    if dx.shape[1] > 0:
        _unshift(np.dot(d, _by_taps(weight)), dilation, step, dx)


@njit(cache=True, fastmath=True, error_model="numpy")
def run_block(x, step, w1, o1, w2, o2, skip, skip_offset, dilation, columns1, y1, columns2, y2, kept, y):
    """y = ReLU(conv(conv(x)) + skip x) at every `step`-th sample counted from the end; an empty `skip` is the identity.

    The samples of x that are skipped to are left in `kept`.
    """
    batch, answers, outputs = y.shape
    channels = x.shape[2]
    first = x.shape[1] - 1 - (answers - 1) * step
    for b in range(batch):
        for s in range(answers):
            for c in range(channels):
                kept[b, s, c] = x[b, first + s * step, c]
    run_conv(x, w1, o1, dilation, 1, columns1, y1)
    run_conv(y1, w2, o2, dilation, step, columns2, y2)
    if skip.shape[0]:
        around = np.dot(kept.reshape(batch * answers, channels), skip.T).reshape(y.shape)
        for b in range(batch):
            for s in range(answers):
                for g in range(outputs):
                    y[b, s, g] = max(y2[b, s, g] + around[b, s, g] + skip_offset[g], 0)
    else:
        for b in range(batch):
            for s in range(answers):
                for g in range(outputs):
                    y[b, s, g] = max(y2[b, s, g] + kept[b, s, g], 0)


@njit(cache=True, fastmath=True, error_model="numpy")
def back_block(
    step, w1, w2, skip, dilation, columns1, y1, columns2, y2, kept, y, dy, dw1, do1, dw2, do2, d_skip, do_skip, dx
):
    """Backward pass of `run_block`; without samples in dx its gradient is left out."""
    batch, answers, outputs = y.shape
    channels = kept.shape[2]
    d, dy1 = np.empty_like(y), np.empty_like(y1)
    for b in range(batch):
        for s in range(answers):
            for g in range(outputs):
                d[b, s, g] = dy[b, s, g] if y[b, s, g] > 0 else 0
    back_conv(w2, columns2, y2, d, dilation, step, dw2, do2, dy1)
    back_conv(w1, columns1, y1, dy1, dilation, 1, dw1, do1, dx)
    flat = d.reshape(batch * answers, outputs)
    if skip.shape[0]:
        d_skip[:] = np.dot(flat.T, kept.reshape(batch * answers, channels))
        do_skip[:] = 0
        for row in range(batch * answers):
            for g in range(outputs):
                do_skip[g] += flat[row, g]
    if dx.shape[1] > 0:
        around = np.dot(flat, skip).reshape(kept.shape) if skip.shape[0] else d
        first = dx.shape[1] - 1 - (answers - 1) * step
        for b in range(batch):
            for s in range(answers):
                for c in range(channels):
                    dx[b, first + s * step, c] += around[b, s, c]


@njit(cache=True, fastmath=True, error_model="numpy")
def _halve(y, mean):
    """The means of each two samples."""
    for b in range(mean.shape[0]):
        for t in range(mean.shape[1]):
            for g in range(mean.shape[2]):
                mean[b, t, g] = (y[b, 2 * t, g] + y[b, 2 * t + 1, g]) / 2


@njit(cache=True, fastmath=True, error_model="numpy")
def _double(d_mean, dy):
    """Backward pass of `_halve`."""
    for b in range(d_mean.shape[0]):
        for t in range(d_mean.shape[1]):
            for g in range(d_mean.shape[2]):
                dy[b, 2 * t, g] = dy[b, 2 * t + 1, g] = d_mean[b, t, g] / 2


@njit(cache=True, fastmath=True, error_model="numpy")
def run_pooled(x, w1, o1, w2, o2, w3, o3, columns1, y1, mean1, columns2, y2, mean2, columns3, y3):
    """Two convolutions, each followed by the mean of each two samples, and a third one at the last sample."""
    run_conv(x, w1, o1, 1, 1, columns1, y1)
    _halve(y1, mean1)
    run_conv(mean1, w2, o2, 1, 1, columns2, y2)
    _halve(y2, mean2)
    run_conv(mean2, w3, o3, 1, mean2.shape[1], columns3, y3)


@njit(cache=True, fastmath=True, error_model="numpy")
def back_pooled(
    w1, w2, w3, columns1, y1, mean1, columns2, y2, mean2, columns3, y3, dy3, dw1, do1, dw2, do2, dw3, do3, dx
):
    """Backward pass of `run_pooled`; without samples in dx its gradient is left out."""
    d_mean1, d_mean2 = np.empty_like(mean1), np.empty_like(mean2)
    dy1, dy2 = np.empty_like(y1), np.empty_like(y2)
    back_conv(w3, columns3, y3, dy3, 1, mean2.shape[1], dw3, do3, d_mean2)
    _double(d_mean2, dy2)
    back_conv(w2, columns2, y2, dy2, 1, 1, dw2, do2, d_mean1)
    _double(d_mean1, dy1)
    back_conv(w1, columns1, y1, dy1, 1, 1, dw1, do1, dx)
