"""Small linear systems, compiled: the numbers of each experiment are eliminated from the normal equations."""

from __future__ import annotations

import numpy as np
from numba import njit, types

TINY = 1e-12  # beside a diagonal of ones: no block is singular

_vector, _matrix, _cube = types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1]


@njit(types.void(_matrix, _matrix), cache=True, nogil=True)
def solve_in_place(a, b):  # noqa: PLR0912 - loops over small matrices
    """Replace b by x of a x = b, a being destroyed: elimination with partial pivoting (Golub and Van Loan, 3.4.1)."""
    n, columns = b.shape
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(n):
                a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
            for j in range(columns):
                b[k, j], b[pivot, j] = b[pivot, j], b[k, j]
        for i in range(k + 1, n):
            factor = a[i, k] / a[k, k] if a[k, k] != 0.0 else 0.0
            if factor != 0.0:
                for j in range(k + 1, n):
                    a[i, j] -= factor * a[k, j]
                for j in range(columns):
                    b[i, j] -= factor * b[k, j]
    for k in range(n - 1, -1, -1):
        for j in range(columns):
            for i in range(k + 1, n):
                b[k, j] -= a[k, i] * b[i, j]
            b[k, j] = b[k, j] / a[k, k] if a[k, k] != 0.0 else 0.0


@njit(types.void(_cube, _cube, _vector), cache=True, nogil=True)
def solve_blocks(blocks, right, damping):
    """Replace right [E, q, k] by the solutions of the damped blocks [E, q, q], numbers in units of their own slopes."""
    experiments, q, columns = right.shape
    a, scale = np.empty((q, q)), np.empty(q)
    for experiment in range(experiments):
        block, b = blocks[experiment], right[experiment]
        for i in range(q):
            scale[i] = np.sqrt(block[i, i]) if block[i, i] > 0.0 else 1.0
        for i in range(q):
            for j in range(q):
                a[i, j] = block[i, j] / scale[i] / scale[j]
            a[i, i] = 1.0 + damping[experiment] + TINY
            for j in range(columns):
                b[i, j] /= scale[i]
        solve_in_place(a, b)
        for i in range(q):
            for j in range(columns):
                b[i, j] /= scale[i]


@njit(
    types.void(_matrix, _vector, _cube, _cube, _matrix, types.float64, _matrix, _vector, _cube), cache=True, nogil=True
)
def eliminate(h, gradient, cross, blocks, block_gradient, damping, h_left, gradient_left, solved):
    """Fill what is left of h and of the gradient, and solved [E, q, p + 1]: blocks^-1 (cross', block gradient)."""
    experiments, p, q = cross.shape
    for experiment in range(experiments):
        for i in range(q):
            for j in range(p):
                solved[experiment, i, j] = cross[experiment, j, i]
            solved[experiment, i, p] = block_gradient[experiment, i]
    solve_blocks(blocks, solved, np.full(experiments, damping))
    for i in range(p):
        gradient_left[i] = gradient[i]
        for j in range(p):
            h_left[i, j] = h[i, j]
        for experiment in range(experiments):
            for k in range(q):
                weight = cross[experiment, i, k]
                gradient_left[i] -= weight * solved[experiment, k, p]
                for j in range(p):
                    h_left[i, j] -= weight * solved[experiment, k, j]


@njit(
    types.float64(
        _matrix, _vector, _cube, _cube, _matrix, types.boolean[::1], types.float64, _vector, _matrix
    ),
    cache=True, nogil=True,
)  # fmt: skip
def damped_step(h, gradient, cross, blocks, block_gradient, inside, damping, step, local):
    """Fill the damped step of theta where it is `inside`, and those of each experiment; return the gain they promise.

    (H + damping diag H) step = gradient, with the numbers of each experiment eliminated (Marquardt 1963).
    """
    experiments, p, q = cross.shape
    h_left, gradient_left = np.empty((p, p)), np.empty(p)
    solved = np.empty((experiments, q, p + 1))
    eliminate(h, gradient, cross, blocks, block_gradient, damping, h_left, gradient_left, solved)
    free = np.flatnonzero(inside)
    matrix, right, scale = np.empty((len(free), len(free))), np.empty((len(free), 1)), np.empty(len(free))
    for i in range(len(free)):
        scale[i] = np.sqrt(h[free[i], free[i]]) if h[free[i], free[i]] > 0.0 else 1.0
    for i in range(len(free)):
        for j in range(len(free)):
            matrix[i, j] = h_left[free[i], free[j]] / scale[i] / scale[j]
        matrix[i, i] += damping + 10 * TINY
        right[i, 0] = gradient_left[free[i]] / scale[i]
    solve_in_place(matrix, right)
    for i in range(p):
        step[i] = 0.0
    promised = 0.0
    for i in range(len(free)):
        step[free[i]] = right[i, 0] / scale[i]
        promised += step[free[i]] * gradient_left[free[i]]
    for experiment in range(experiments):
        for k in range(q):
            promised += solved[experiment, k, p] * block_gradient[experiment, k]
            local[experiment, k] = solved[experiment, k, p]
            for j in range(p):
                local[experiment, k] -= solved[experiment, k, j] * step[j]
    return promised
