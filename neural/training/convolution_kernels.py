"""Causal convolutions over time with ReLU, compiled: im2col, matrix product, ReLU.

Arrays are x [B, T, C], weights [G, C, K] as in PyTorch, y [B, S, G] with every `step`-th sample counted from the end;
tap K-1 meets the newest sample.
"""

from __future__ import annotations

import numpy as np
from numba import njit

# Numbers in an im2col matrix: a larger one is made piece by piece, because it would not fit into the cache.
AT_ONCE = 1 << 17


@njit(cache=True, fastmath=True, error_model="numpy")
def _by_taps(weight):
    """Reorder weights [G, C, K] to a matrix [G, K C]."""
    outputs, channels, taps = weight.shape
    flat = np.empty((outputs, taps * channels), weight.dtype)
    for g in range(outputs):
        for c in range(channels):
            for j in range(taps):
                flat[g, j * channels + c] = weight[g, c, j]
    return flat


@njit(cache=True, fastmath=True, error_model="numpy")
def _batch_size(answers, columns):
    """Count the sequences whose im2col matrix is made at once."""
    return max(1, AT_ONCE // (answers * columns))


@njit(cache=True, fastmath=True, error_model="numpy")
def _im2col(x, begin, end, dilation, step, answers, columns):
    """Fill `columns` with the samples under the taps for each output sample, of the sequences from `begin` to `end`."""
    steps, channels = x.shape[1:]
    taps = columns.shape[1] // channels
    first = steps - 1 - (answers - 1) * step - (taps - 1) * dilation
    flat = x.reshape(x.shape[0], steps * channels)
    for b in range(begin, end):
        for s in range(answers):
            row = columns[(b - begin) * answers + s]
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


@njit(cache=True, fastmath=True, error_model="numpy")
def _col2im(columns, begin, end, dilation, step, answers, x):
    """Add every entry of `columns` to the sample of x that `_im2col` copied it from."""
    steps, channels = x.shape[1:]
    taps = columns.shape[1] // channels
    first = steps - 1 - (answers - 1) * step - (taps - 1) * dilation
    flat = x.reshape(x.shape[0], steps * channels)
    for b in range(begin, end):
        for s in range(answers):
            row = columns[(b - begin) * answers + s]
            start = first + s * step
            if dilation == 1 and start >= 0:
                for i in range(taps * channels):
                    flat[b, start * channels + i] += row[i]
                continue
            for j in range(taps):
                source = start + j * dilation
                if source >= 0:
                    for c in range(channels):
                        x[b, source, c] += row[j * channels + c]


@njit(cache=True, fastmath=True, error_model="numpy")
def run_conv(x, weight, offset, dilation, step, y):
    """Compute y(k) = ReLU(offset + sum over j of W_j x(k - (K-1-j) dilation)), zeros before the start."""
    batch, answers, outputs = y.shape
    flat = np.ascontiguousarray(_by_taps(weight).T)
    values = y.reshape(batch * answers, outputs)
    at_once = _batch_size(answers, flat.shape[0])
    columns = np.empty((min(batch, at_once) * answers, flat.shape[0]), x.dtype)
    for begin in range(0, batch, at_once):
        end = min(batch, begin + at_once)
        _im2col(x, begin, end, dilation, step, answers, columns)
        np.dot(columns[: (end - begin) * answers], flat, values[begin * answers : end * answers])
    for row in range(batch * answers):
        for g in range(outputs):
            values[row, g] = max(values[row, g] + offset[g], 0)


@njit(cache=True, fastmath=True, error_model="numpy")
def back_conv(x, weight, y, dy, dilation, step, d_weight, d_offset, dx):
    """Compute the gradients of the weights, of the offset and, where dx has samples, of x."""
    batch, answers, outputs = y.shape
    _, channels, taps = weight.shape
    flat = _by_taps(weight)
    of_columns = np.zeros((outputs, taps * channels), y.dtype)
    at_once = _batch_size(answers, taps * channels)
    columns = np.empty((min(batch, at_once) * answers, taps * channels), y.dtype)
    d = np.empty((min(batch, at_once) * answers, outputs), y.dtype)
    d_offset[:] = 0
    dx[:] = 0
    for begin in range(0, batch, at_once):
        end = min(batch, begin + at_once)
        rows = (end - begin) * answers
        for b in range(begin, end):
            for s in range(answers):
                row = d[(b - begin) * answers + s]
                for g in range(outputs):
                    row[g] = dy[b, s, g] if y[b, s, g] > 0 else 0
                    d_offset[g] += row[g]
        _im2col(x, begin, end, dilation, step, answers, columns)
        of_columns += np.dot(d[:rows].T, columns[:rows])
        if dx.shape[1] > 0:
            np.dot(d[:rows], flat, columns[:rows])
            _col2im(columns, begin, end, dilation, step, answers, dx)
    for g in range(outputs):
        for c in range(channels):
            for j in range(taps):
                d_weight[g, c, j] = of_columns[g, j * channels + c]


@njit(cache=True, fastmath=True, error_model="numpy")
def run_block(x, step, w1, o1, w2, o2, skip, skip_offset, dilation, y1, y2, skipped, y):
    """Compute y = ReLU(conv(conv(x)) + skip x) at every `step`-th sample from the end; an empty `skip` is the identity.

    The samples of x that enter by the skip connection are stored in `skipped`.
    """
    batch, answers, outputs = y.shape
    channels = x.shape[2]
    first = x.shape[1] - 1 - (answers - 1) * step
    for b in range(batch):
        for s in range(answers):
            for c in range(channels):
                skipped[b, s, c] = x[b, first + s * step, c]
    run_conv(x, w1, o1, dilation, 1, y1)
    run_conv(y1, w2, o2, dilation, step, y2)
    if skip.shape[0]:
        through_skip = np.dot(skipped.reshape(batch * answers, channels), skip.T).reshape(y.shape)
        for b in range(batch):
            for s in range(answers):
                for g in range(outputs):
                    y[b, s, g] = max(y2[b, s, g] + through_skip[b, s, g] + skip_offset[g], 0)
    else:
        for b in range(batch):
            for s in range(answers):
                for g in range(outputs):
                    y[b, s, g] = max(y2[b, s, g] + skipped[b, s, g], 0)


@njit(cache=True, fastmath=True, error_model="numpy")
def back_block(x, step, w1, w2, skip, dilation, y1, y2, skipped, y, dy, dw1, do1, dw2, do2, d_skip, do_skip, dx):
    """Run `run_block` backwards; without samples in dx its gradient is left out."""
    batch, answers, outputs = y.shape
    channels = skipped.shape[2]
    d, dy1 = np.empty_like(y), np.empty_like(y1)
    for b in range(batch):
        for s in range(answers):
            for g in range(outputs):
                d[b, s, g] = dy[b, s, g] if y[b, s, g] > 0 else 0
    back_conv(y1, w2, y2, d, dilation, step, dw2, do2, dy1)
    back_conv(x, w1, y1, dy1, dilation, 1, dw1, do1, dx)
    flat = d.reshape(batch * answers, outputs)
    if skip.shape[0]:
        d_skip[:] = np.dot(flat.T, skipped.reshape(batch * answers, channels))
        do_skip[:] = 0
        for row in range(batch * answers):
            for g in range(outputs):
                do_skip[g] += flat[row, g]
    if dx.shape[1] > 0:
        through_skip = np.dot(flat, skip).reshape(skipped.shape) if skip.shape[0] else d
        first = dx.shape[1] - 1 - (answers - 1) * step
        for b in range(batch):
            for s in range(answers):
                for c in range(channels):
                    dx[b, first + s * step, c] += through_skip[b, s, c]


@njit(cache=True, fastmath=True, error_model="numpy")
def _halve(y, mean):
    """Average each two samples."""
    for b in range(mean.shape[0]):
        for t in range(mean.shape[1]):
            for g in range(mean.shape[2]):
                mean[b, t, g] = (y[b, 2 * t, g] + y[b, 2 * t + 1, g]) / 2


@njit(cache=True, fastmath=True, error_model="numpy")
def _double(d_mean, dy):
    """Run `_halve` backwards."""
    for b in range(d_mean.shape[0]):
        for t in range(d_mean.shape[1]):
            for g in range(d_mean.shape[2]):
                dy[b, 2 * t, g] = dy[b, 2 * t + 1, g] = d_mean[b, t, g] / 2


@njit(cache=True, fastmath=True, error_model="numpy")
def run_pooled(x, w1, o1, w2, o2, w3, o3, y1, mean1, y2, mean2, y3):
    """Convolve twice, each time averaging pairs of samples, then a third time at the last sample."""
    run_conv(x, w1, o1, 1, 1, y1)
    _halve(y1, mean1)
    run_conv(mean1, w2, o2, 1, 1, y2)
    _halve(y2, mean2)
    run_conv(mean2, w3, o3, 1, mean2.shape[1], y3)


@njit(cache=True, fastmath=True, error_model="numpy")
def back_pooled(x, w1, w2, w3, y1, mean1, y2, mean2, y3, dy3, dw1, do1, dw2, do2, dw3, do3, dx):
    """Run `run_pooled` backwards; without samples in dx its gradient is left out."""
    d_mean1, d_mean2 = np.empty_like(mean1), np.empty_like(mean2)
    dy1, dy2 = np.empty_like(y1), np.empty_like(y2)
    back_conv(mean2, w3, y3, dy3, 1, mean2.shape[1], dw3, do3, d_mean2)
    _double(d_mean2, dy2)
    back_conv(mean1, w2, y2, dy2, 1, 1, dw2, do2, d_mean1)
    _double(d_mean1, dy1)
    back_conv(x, w1, y1, dy1, 1, 1, dw1, do1, dx)
