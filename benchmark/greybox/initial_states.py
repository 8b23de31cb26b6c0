"""Initial states, from the first samples of a record and from where the training records start."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simgap.greybox.fitting import Estimate, descend
from simgap.greybox.noise import Noise
from simgap.greybox.normal_equations import scales_of
from simgap.greybox.plant import Plant
from simgap.greybox.problem import Problem
from simgap.greybox.samples import Records

INITIAL_STEPS = 15
# What an error in training tells of one in the first samples: the second may be far smaller, and lasts.
WEIGHTS = (0.01, 0.1, 1.0, 10.0)


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


def usual_start(plant: Plant, estimate: Estimate, records: Records, noise: Noise, n_init: int) -> UsualStart | None:
    """Learn how the training records start, from their initial states as all of their samples tell them.

    The scatter is that of Student's t, which the next start has after E normal ones of unknown mean and covariance S:
    S (1 + 1/E) (E - 1) / (E - q - 2) (Gelman et al., Bayesian Data Analysis, 2013, section 3.6). How much it weighs is
    what serves free runs in training best; None where it serves none, and where too few records tell of it.
    """
    theta, e, q = estimate.theta, len(estimate.local), plant.order
    if not 0 < q < e - 2 or plant.sign_hidden or n_init >= len(records.u[0]):
        return None
    starts = estimate.local[:, :q]
    size = scales_of(np.var(starts, axis=0))
    scatter = np.cov(starts.T / size[:, None]).reshape(q, q) * (1 + 1 / e) * (e - 1) / (e - q - 2)
    precision = np.linalg.inv(scatter + 1e-9 * np.eye(q)) / size / size[:, None]
    variance = float(np.sum(noise.whiten(estimate.errors) ** 2)) / (records.samples * plant.ny)
    beginning, whole = Problem(plant, records.beginning(n_init), noise), Problem(plant, records, noise)
    found = initial_states(beginning, theta)
    tried = [UsualStart(starts.mean(axis=0), weight * variance * precision) for weight in WEIGHTS]

    def squares(local: np.ndarray) -> float:
        return float(np.sum(noise.whiten(whole.errors(theta, local))[:, n_init:] ** 2))

    least, best = min(((squares(one.beside(beginning, theta, found)), one) for one in tried), key=lambda pair: pair[0])
    return best if least < squares(found) else None
