"""One sample of each layer, written as step forms are; weights and their order are PyTorch's, as flat lists.

A layer takes x [nx] and fills y or the state s from s[at] on. tests/neural holds each network to its whole sequence.
"""

from __future__ import annotations

import math


def sigmoid(x: float):
    """1 / (1 + exp(-x))."""
    if x >= 0.0:
        return 1.0 / (1.0 + math.exp(-x))
    return math.exp(x) / (1.0 + math.exp(x))


def weighted(row: int, x: list, at: int, n: int, w: list):
    """Sum of row `row` of w [.., n] times x[at], x[at + 1], .."""
    total = 0.0
    for i in range(n):
        total += w[row * n + i] * x[at + i]
    return total


def dense(x: list, nx: int, y: list, ny: int, w: list, b: list, positive: int):
    """y = W x + b, cut at zero where `positive` is 1."""
    for i in range(ny):
        y[i] = b[i] + weighted(i, x, 0, nx, w)
        if positive == 1:
            y[i] = max(y[i], 0.0)


def rnn(x: list, nx: int, s: list, at: int, n: int, new: list, w: list, u: list, b: list, c: list):
    """h = tanh(W x + b + U h + c)."""
    for i in range(n):
        new[i] = math.tanh(weighted(i, x, 0, nx, w) + weighted(i, s, at, n, u) + b[i] + c[i])
    for i in range(n):
        s[at + i] = new[i]


def gru(x: list, nx: int, s: list, at: int, n: int, new: list, w: list, u: list, b: list, c: list):
    """h = (1 - z) tanh(W x + b + r (U h + c)) + z h, with the gates r and z."""
    for i in range(n):
        r = sigmoid(weighted(i, x, 0, nx, w) + b[i] + weighted(i, s, at, n, u) + c[i])
        z = sigmoid(weighted(n + i, x, 0, nx, w) + b[n + i] + weighted(n + i, s, at, n, u) + c[n + i])
        inner = weighted(2 * n + i, s, at, n, u) + c[2 * n + i]
        candidate = math.tanh(weighted(2 * n + i, x, 0, nx, w) + b[2 * n + i] + r * inner)
        new[i] = (1.0 - z) * candidate + z * s[at + i]
    for i in range(n):
        s[at + i] = new[i]


def lstm(x: list, nx: int, s: list, at: int, n: int, new: list, w: list, u: list, b: list, c: list):
    """c' = f c + i g, h = o tanh(c'), with the gates i, f and o; h stands at s[at], c' behind it."""
    for i in range(n):
        take = sigmoid(weighted(i, x, 0, nx, w) + b[i] + weighted(i, s, at, n, u) + c[i])
        keep = sigmoid(weighted(n + i, x, 0, nx, w) + b[n + i] + weighted(n + i, s, at, n, u) + c[n + i])
        g = math.tanh(weighted(2 * n + i, x, 0, nx, w) + b[2 * n + i] + weighted(2 * n + i, s, at, n, u) + c[2 * n + i])
        show = sigmoid(
            weighted(3 * n + i, x, 0, nx, w) + b[3 * n + i] + weighted(3 * n + i, s, at, n, u) + c[3 * n + i]
        )
        s[at + n + i] = keep * s[at + n + i] + take * g
        new[i] = show * math.tanh(s[at + n + i])
    for i in range(n):
        s[at + i] = new[i]


def remember(x: list, nx: int, s: list, at: int, length: int):
    """Append x to the last `length` ones, from s[at] on, and forget the oldest."""
    for i in range((length - 1) * nx):
        s[at + i] = s[at + nx + i]
    for i in range(nx):
        s[at + (length - 1) * nx + i] = x[i]


def convolution(x: list, nx: int, s: list, at: int, y: list, ny: int, w: list, b: list, kernel: int, dilation: int):
    """y(k) = ReLU(b + sum over j of W_j x(k - (kernel - 1 - j) dilation)); s[at], .. hold what it reads."""
    remember(x, nx, s, at, (kernel - 1) * dilation + 1)
    for o in range(ny):
        total = b[o]
        for i in range(nx):
            for j in range(kernel):
                total += w[(o * nx + i) * kernel + j] * s[at + j * dilation * nx + i]
        y[o] = max(total, 0.0)


def mean_of_two(x: list, nx: int, s: list, at: int, delay: int, y: list):
    """y(k) = (x(k) + x(k - delay)) / 2."""
    remember(x, nx, s, at, delay + 1)
    for i in range(nx):
        y[i] = 0.5 * (x[i] + s[at + i])


def add(x: list, z: list, n: int, y: list, positive: int):
    """y = x + z, cut at zero where `positive` is 1."""
    for i in range(n):
        y[i] = x[i] + z[i]
        if positive == 1:
            y[i] = max(y[i], 0.0)


def copy(x: list, n: int, y: list, at: int):
    """y[at], y[at + 1], .. = x."""
    for i in range(n):
        y[at + i] = x[i]


def gated(x: list, nx: int, count: int, y: list):
    """y = x and, behind it, its first `count` values times its last one."""
    copy(x, nx, y, 0)
    for i in range(count):
        y[nx + i] = x[i] * x[nx - 1]


def read(s: list, at: int, n: int, y: list):
    """y = s[at], s[at + 1], .."""
    for i in range(n):
        y[i] = s[at + i]


def hold(x: list, n: int, s: list, at: int, weight: float):
    """Move n states from s[at] on towards x, by a weight of 0 (stay) to 1 (become x)."""
    for i in range(n):
        s[at + i] += weight * (x[i] - s[at + i])


def squash(x: list, n: int):
    """x = tanh(x)."""
    for i in range(n):
        x[i] = math.tanh(x[i])


def gate(x: list, z: list, n: int, y: list):
    """y = x sigmoid(z)."""
    for i in range(n):
        y[i] = x[i] * sigmoid(z[i])


def diagonal(v: list, s: list, at: int, n: int, re: list, im: list):
    """s = lambda s + v, complex: the real parts of n states from s[at] on, then the imaginary ones."""
    for i in range(n):
        real = re[i] * s[at + i] - im[i] * s[at + n + i] + v[i]
        s[at + n + i] = re[i] * s[at + n + i] + im[i] * s[at + i] + v[n + i]
        s[at + i] = real


def read_off(x: list, nx: int, s: list, at: int, n: int, y: list, w: list, through: list):
    """y = W s + d x, of n numbers from s[at] on."""
    for i in range(nx):
        y[i] = weighted(i, s, at, n, w) + through[i] * x[i]


def section(x: list, n: int, s: list, at: int, y: list, num: list, den: list):
    """y(k) = b0 x(k) + b1 x(k-1) + b2 x(k-2) - a1 y(k-1) - a2 y(k-2) of n channels; their states from s[at] on."""
    for i in range(n):
        y[i] = num[i] * x[i] + s[at + i]
        s[at + i] = num[n + i] * x[i] - den[i] * y[i] + s[at + n + i]
        s[at + n + i] = num[2 * n + i] * x[i] - den[n + i] * y[i]


def normed(x: list, n: int, y: list, gain: list, offset: list, least: float):
    """y = gain (x - mean) / sqrt(variance + least) + offset."""
    mean = 0.0
    for i in range(n):
        mean += x[i] / n
    square = least
    for i in range(n):
        square += (x[i] - mean) * (x[i] - mean) / n
    for i in range(n):
        y[i] = gain[i] * (x[i] - mean) / math.sqrt(square) + offset[i]


def attend(q: list, n: int, s: list, at: int, span: int, score: list, heads: int, size: int, y: list, b: list):
    """y = sum over j of softmax_j(q k(j) / sqrt(size) + b_j) v(j), in heads of that size; s[at], .. hold k and v."""
    for h in range(heads):
        top = -1e300
        for j in range(span):
            score[j] = 0.0
            for i in range(size):
                score[j] += q[h * size + i] * s[at + (span - 1 - j) * 2 * n + h * size + i]
            score[j] = score[j] / math.sqrt(size) + b[h * span + j]
            top = max(top, score[j])
        total = 0.0
        for j in range(span):
            score[j] = math.exp(score[j] - top)
            total += score[j]
        for i in range(size):
            y[h * size + i] = 0.0
            for j in range(span):
                y[h * size + i] += score[j] / total * s[at + (span - 1 - j) * 2 * n + n + h * size + i]
