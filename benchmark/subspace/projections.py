"""Subspace identification: the extended observability matrix from projections of future outputs, then A, B, C, D."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.linalg import solve_triangular

from simgap.records import Experiment
from simgap.subspace.kernels import pushed
from simgap.subspace.state_space import StateSpace, in_blocks

WEIGHTINGS = ("n4sid", "moesp", "cva")
CHUNK = 4096


def state_spaces(experiments: Sequence[Experiment], orders: Sequence[int], horizon: int) -> Iterator[StateSpace]:
    """Yield a model of each order by each weighting: A and C from the shift of Gamma, then B and D by least squares.

    Van Overschee and De Moor 1994 (N4SID) and 1995 (the weightings MOESP and CVA as cases of one theorem).

    Past and future of `horizon` samples each are compared; an order that they cannot show has no model.
    """
    u, y = (np.concatenate([getattr(e, signal) for e in experiments]) for signal in "uy")
    means, sizes = (u.mean(axis=0), y.mean(axis=0)), (_size(u), _size(y))
    scaled = [((e.u - means[0]) / sizes[0], (e.y - means[1]) / sizes[1]) for e in experiments]
    factor = _triangle(scaled, horizon)
    nu, ny = u.shape[1], y.shape[1]
    for weighting in WEIGHTINGS:
        directions, values = _directions(factor, horizon * nu + 1, horizon * ny, weighting)
        for order in orders:
            if order <= len(values) - ny and values[order - 1] > 1e-10 * values[0]:
                gamma = directions[:, :order] * np.sqrt(values[:order])
                a, c = in_blocks(_stable(np.linalg.lstsq(gamma[:-ny], gamma[ny:], rcond=None)[0]), gamma[:ny])
                b, d, offset = _inputs(scaled, a, c)
                yield with_spread(
                    StateSpace(
                        a, b / sizes[0], c * sizes[1][:, None], d / sizes[0] * sizes[1][:, None],
                        means[0], means[1] + offset * sizes[1], sizes[1] ** 2, np.eye(order), experiments[0].dt,
                    ), experiments, 1,
                )  # fmt: skip


def with_spread(model: StateSpace, experiments: Sequence[Experiment], n_init: int) -> StateSpace:
    """Take the variances of the simulation error, and the covariance of the states, from these experiments."""
    _, gain = model.free_response(n_init)
    errors, states = [], []
    for e in experiments:
        u, y = e.u - model.u_mean, e.y - model.y_mean
        y_hat, x = model.run(u, model.start_state(u[:n_init], y[:n_init], gain))
        errors.append((y_hat - y)[n_init:])
        states.append(x)
    x = np.concatenate(states)
    values, vectors = np.linalg.eigh(x.T @ x / len(x))
    root = vectors * np.sqrt(np.maximum(values, 1e-9 * values[-1]))
    return replace(model, noise=np.mean(np.concatenate(errors) ** 2, axis=0), root=root)


def _triangle(scaled: list[tuple[np.ndarray, np.ndarray]], horizon: int) -> Float[np.ndarray, "R R"]:
    """Compute L of L Q = (1; future u; past u; past y; future y), every experiment with columns of its own."""
    nu, ny = scaled[0][0].shape[1], scaled[0][1].shape[1]
    triangle = np.zeros((0, 2 * horizon * (nu + ny) + 1))
    for u, y in scaled:
        columns = len(u) - 2 * horizon + 1
        for start in range(0, columns, CHUNK):
            n = min(CHUNK, columns - start)
            past = [signal[start + k : start + k + n] for signal in (u, y) for k in range(horizon)]
            future = [[s[start + k : start + k + n] for k in range(horizon, 2 * horizon)] for s in (u, y)]
            rows = np.concatenate([np.ones((n, 1)), *future[0], *past, *future[1]], axis=1)
            triangle = np.asarray(np.linalg.qr(np.concatenate((triangle, rows)), mode="r"))
    return triangle.T


def _directions(
    factor: Float[np.ndarray, "R R"], inputs: int, outputs: int, weighting: str
) -> tuple[np.ndarray, np.ndarray]:
    """Compute the left singular vectors, with the weighting undone, and the singular values."""
    past = slice(inputs, len(factor) - outputs)
    known, future = factor[past, past], factor[-outputs:, past]
    if weighting == "n4sid":
        projection = future @ np.linalg.pinv(known, rcond=1e-10) @ factor[past, : past.stop]
    elif weighting == "moesp":
        projection = future
    else:
        covariance = factor[-outputs:, inputs:] @ factor[-outputs:, inputs:].T
        scale = np.trace(covariance) / len(covariance)
        root = np.linalg.cholesky(covariance + 1e-12 * scale * np.eye(outputs))
        left, values, _ = np.linalg.svd(solve_triangular(root, future, lower=True), full_matrices=False)
        return root @ left, values
    left, values, _ = np.linalg.svd(projection, full_matrices=False)
    return left, values


def stable_matrix(a: Float[np.ndarray, "n n"], radius: float) -> Float[np.ndarray, "n n"]:
    """Move eigenvalues outside the circle of `radius` onto it."""
    values, vectors = np.linalg.eig(a)
    size = np.maximum(np.abs(values), 1e-300)
    if (size <= radius).all():
        return a
    moved = values * np.minimum(1.0, radius / size)
    return np.real(np.linalg.solve(vectors.T, (vectors * moved).T).T)


def _stable(a: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(stable_matrix(a, 1 - 1e-4))


def _inputs(
    scaled: list[tuple[np.ndarray, np.ndarray]], a: np.ndarray, c: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find B, D and a constant: y is linear in them; the free response of each experiment is projected out."""
    (n, ny), nu = c.T.shape, scaled[0][0].shape[1]
    c, count = np.ascontiguousarray(c), n * nu + ny * nu + ny
    products = np.zeros((count + 1, count + 1))
    for u, y in scaled:
        length = len(u)
        columns = np.zeros((count + 1, length, ny))
        columns[: n * nu] = pushed(a, c, np.zeros((length, 0)), np.ascontiguousarray(u)).reshape(n * nu, length, ny)
        for o in range(ny):
            columns[n * nu + o * nu : n * nu + (o + 1) * nu, :, o] = u.T
            columns[n * nu + ny * nu + o, :, o] = 1.0
        columns[-1] = y
        impulse = np.eye(length + 1, 1)
        free = pushed(a, c, np.zeros((length + 1, 0)), impulse)[:, 0, 1:].reshape(n, -1)
        basis = np.linalg.qr(free.T)[0]
        flat = columns.reshape(count + 1, -1)
        flat = flat - (flat @ basis) @ basis.T
        products += flat @ flat.T
    theta = np.linalg.lstsq(products[:-1, :-1], products[:-1, -1], rcond=1e-12)[0]
    b, d, offset = np.split(theta, [n * nu, n * nu + ny * nu])
    return b.reshape(n, nu), d.reshape(ny, nu), offset


def _size(signals: np.ndarray) -> np.ndarray:
    size = signals.std(axis=0)
    return np.where(size > 0, size, 1.0)
