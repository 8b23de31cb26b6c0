"""Initial states: where each simulation begins, from the measured samples of its record; the model is known."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from simgap.greybox.fitting import DIFFERENCE, Problem
from simgap.greybox.noise import Noise
from simgap.greybox.plant import Plant
from simgap.greybox.samples import Records

MAX_STEPS = 15
TOLERANCE = 1e-3  # of the noise's variance: less than this is not worth another step
MOST_DAMPED = 1e10


def initial_states(
    plant: Plant,
    theta: Float[np.ndarray, " p"],
    u: Float[np.ndarray, "B n nu"],
    y: Float[np.ndarray, "B n ny"],
    noise: Noise,
) -> Float[np.ndarray, "B q"]:
    """Find the states at the first sample by least squares on all samples of each record.

    Levenberg-Marquardt for all records side by side, each with a damping of its own, so that none changes another's.
    The plant has no numbers of single experiments but the start.
    """
    problem = _problem(plant, u, y, noise)
    local = problem.at_rest(theta)
    if plant.sign_hidden:
        local = problem.other_side(theta, local)
    errors = problem.errors(theta, local)
    squares, damping = _squares(noise, errors), np.full(len(y), 1e-3)
    left = np.flatnonzero(np.isfinite(squares))  # the records that are still on their way
    for _ in range(MAX_STEPS):
        if not len(left):
            break
        jacobian = _jacobian(_problem(plant, u[left], y[left], noise), theta, local[left])  # [E, q, M]
        white = noise.whiten(errors[left]).reshape(len(left), -1, 1)
        hessian, gradient = jacobian @ jacobian.swapaxes(1, 2), jacobian @ white  # [E, q, q], [E, q, 1]
        usable = np.isfinite(hessian).all(axis=(1, 2))
        promised = np.zeros(len(left))
        promised[usable] = _promise(hessian[usable], gradient[usable])
        on = promised > TOLERANCE * squares[left] / (y.shape[1] * plant.ny)
        left, hessian, gradient = left[on], hessian[on], gradient[on]
        trying, moved = np.arange(len(left)), np.zeros(len(left), dtype=bool)
        while len(trying):
            rows = left[trying]
            trial = local[rows] + _step(hessian[trying], gradient[trying], damping[rows])
            found = _problem(plant, u[rows], y[rows], noise).errors(theta, trial)
            now = _squares(noise, found)
            better = now < squares[rows]
            good, bad = rows[better], rows[~better]
            # One that hardly gained has arrived as well.
            moved[trying[better]] = squares[good] - now[better] >= 1e-6 * TOLERANCE * squares[good]
            local[good], errors[good], squares[good] = trial[better], found[better], now[better]
            damping[good] = np.maximum(damping[good] / 10, 1e-12)
            damping[bad] = np.maximum(damping[bad] * 6, 1e-6)
            trying = trying[~better][damping[bad] < MOST_DAMPED]
        left = left[moved]
    return local


def _problem(plant: Plant, u: np.ndarray, y: np.ndarray, noise: Noise) -> Problem:
    seen = np.ones(y.shape[:2], dtype=bool)
    return Problem(plant, Records(np.ascontiguousarray(u), y, seen, plant.dt), noise)


def _squares(noise: Noise, errors: np.ndarray) -> Float[np.ndarray, " B"]:
    return np.sum(noise.whiten(errors) ** 2, axis=(1, 2))


def _jacobian(problem: Problem, theta: np.ndarray, local: np.ndarray) -> Float[np.ndarray, "B q M"]:
    """d(simulation)/d(start), whitened, by forward differences in proportion to each record's own spread."""
    plant, y = problem.plant, problem.records.y
    size = DIFFERENCE * (np.std(y[:, :, 0], axis=1) + 1e-12)
    units = [1.0 if plant.cascade else plant.dt**-i for i in range(plant.order)]
    steps = size[:, None] * units  # [B, q]
    moved = np.stack([local, *(local + steps * row for row in np.eye(plant.order))])  # [1 + q, B, q]
    here, *there = problem.simulator.run_many(np.repeat(theta[None], len(moved), axis=0), moved)
    jacobian = [problem.noise.whiten((y_hat - here) / step[:, None, None])
              for y_hat, step in zip(there, steps.T, strict=True)]  # fmt: skip
    return np.stack([slope.reshape(len(y), -1) for slope in jacobian], axis=1)


def _step(hessian: np.ndarray, gradient: np.ndarray, damping: np.ndarray) -> Float[np.ndarray, "B q"]:
    """(H + damping diag H)^-1 g."""
    damped = hessian.copy()
    i = np.arange(hessian.shape[1])
    largest = np.max(hessian, axis=(1, 2), initial=0.0)[:, None]
    damped[:, i, i] = hessian[:, i, i] * (1 + damping[:, None]) + 1e-12 * largest + 1e-300
    return np.linalg.solve(damped, gradient)[:, :, 0]


def _promise(hessian: np.ndarray, gradient: np.ndarray) -> Float[np.ndarray, " B"]:
    """What the quadratic model says that a whole step gains."""
    step = _step(hessian, gradient, np.full(len(hessian), 1e-9))
    return np.sum(step * gradient[:, :, 0], axis=1)
