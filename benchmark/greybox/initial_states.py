"""Initial states, from the first samples of a record and from where the training records start."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simgap.greybox.fitting import Estimate, descend
from simgap.greybox.noise import Noise
from simgap.greybox.normal_equations import scales_of
from simgap.greybox.problem import LARGEST_ERROR, Problem
from simgap.greybox.samples import Records
from simgap.greybox.simulation import Simulator

INITIAL_STEPS = 15
# What an error in training tells of one in the first samples: the second may be far smaller, and lasts.
WEIGHTS = (0.01, 0.1, 1.0, 10.0)
RUNS = 4  # free runs in each of few records


def initial_states(problem: Problem, theta: Float[np.ndarray, " p"]) -> Float[np.ndarray, "B q"]:
    """Find the states at the first sample of records of a few samples; the model is known."""
    plant = problem.plant
    if not plant.n_local:
        return np.zeros((len(problem.records.u), 0))
    return descend(problem, theta, fixed=np.ones(plant.size, dtype=bool), max_steps=INITIAL_STEPS).local


@dataclass(frozen=True, eq=False)
class UsualStart:
    """The initial states that are to be expected: their mean, and the inverse of their scatter."""

    mean: Float[np.ndarray, " q"]
    precision: Float[np.ndarray, "q q"]  # times the variance of the whitened errors

    def beside(self, problem: Problem, theta: np.ndarray, local: np.ndarray) -> Float[np.ndarray, "B n"]:
        """Weigh initial states that suit the first samples against the usual ones.

        x = argmin |W (y - y_hat(x))|^2 + (x - mean)' precision (x - mean),   y_hat linear in x
        """
        slopes = problem.jacobian(theta, local, np.zeros(len(theta), dtype=bool))
        if not slopes.finite:
            return local
        q = len(self.mean)
        k = slopes.local[:q].swapaxes(0, 1)  # [B, q, M]
        h = k @ k.swapaxes(1, 2)
        right = h @ local[:, :q, None] + (self.precision @ self.mean)[:, None]
        scale = scales_of((h + self.precision)[:, range(q), range(q)])[:, :, None]
        matrix = (h + self.precision) / scale / scale.swapaxes(1, 2) + 1e-12 * np.eye(q)
        weighed = local.copy()
        weighed[:, :q] = (np.linalg.solve(matrix, right / scale) / scale)[:, :, 0]
        return weighed


def usual_start(estimate: Estimate, records: Records, noise: Noise, n_init: int) -> UsualStart | None:
    """Learn which initial states are to be expected, from how the training records start or what they pass through.

    Many records tell it by their own starts, few by the states at all their samples, as if the next one began at any of
    them. How much that weighs is what serves free runs in training best, from those starts or from four of each record;
    None where it serves none.
    """
    plant = estimate.plant
    e, q = len(estimate.local), plant.order
    if not q or plant.sign_hidden:
        return None
    if q < e - 2:
        mean, scatter = _of_starts(estimate.local[:, :q])
        runs = records
    else:
        passed = Simulator(plant, records.u, records.past).states(
            estimate.theta[None], estimate.local[None, :, : plant.n_moving]
        )
        states = passed[0][records.mask][:, :q]
        if len(states) <= q or not np.max(np.abs(states)) < LARGEST_ERROR:  # it grows without bound
            return None
        mean, scatter = states.mean(axis=0), np.cov(states.T).reshape(q, q)
        runs = records.pieces(max(records.mask.shape[1] // RUNS, 2 * n_init))
        runs = runs.only(np.flatnonzero(runs.mask.all(axis=1)))
    if n_init >= runs.u.shape[1] or len(runs.u) < 2:
        return None
    variance = float(np.sum(noise.whiten(estimate.errors) ** 2)) / (records.samples * plant.ny)
    precision = variance * _inverse(scatter)
    beginning, whole = Problem(plant, runs.beginning(n_init), noise), Problem(plant, runs, noise)
    found = initial_states(beginning, estimate.theta)

    def squares(local: np.ndarray) -> float:
        return float(np.sum(noise.whiten(whole.errors(estimate.theta, local))[:, n_init:] ** 2))

    tried = [UsualStart(mean, weight * precision) for weight in WEIGHTS]
    of_each = [squares(one.beside(beginning, estimate.theta, found)) for one in tried]
    return tried[int(np.argmin(of_each))] if min(of_each) < squares(found) else None


def _of_starts(starts: Float[np.ndarray, "E q"]) -> tuple[Float[np.ndarray, " q"], Float[np.ndarray, "q q"]]:
    """Return mean and scatter of the next start after E normal ones of unknown mean and covariance S.

    The scatter is that of Student's t, S (1 + 1/E) (E - 1) / (E - q - 2) (Gelman et al., Bayesian Data Analysis, 2013,
    section 3.6).
    """
    e, q = starts.shape
    return starts.mean(axis=0), np.cov(starts.T).reshape(q, q) * (1 + 1 / e) * (e - 1) / (e - q - 2)


def _inverse(scatter: Float[np.ndarray, "q q"]) -> Float[np.ndarray, "q q"]:
    """Invert a covariance in units of its own, with what rounding leaves of directions that never varied."""
    size = scales_of(np.diag(scatter))
    return np.linalg.inv(scatter / size / size[:, None] + 1e-9 * np.eye(len(size))) / size / size[:, None]
