"""How well the data fix the parameters of a plant: the covariance of their estimate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.stats import t as student

from simgap.greybox.fitting import Estimate
from simgap.greybox.noise import Noise
from simgap.greybox.normal_equations import NormalEquations
from simgap.greybox.problem import Problem
from simgap.greybox.samples import Records

BLOCKS = 40


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """The covariance of the estimate of theta, from so many degrees of freedom; 0 for what is not estimated."""

    covariance: Float[np.ndarray, "p p"]
    freedom: int

    def reach(self, level: float = 0.95) -> Float[np.ndarray, " p"]:
        """Return the half width of the interval of each parameter, by Student's t."""
        deviations = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        return float(student.ppf(0.5 + level / 2, self.freedom)) * deviations


def uncertainty(estimate: Estimate, noise: Noise, records: Records) -> Uncertainty | None:
    """Compute it, honest for coloured errors and for what the model cannot explain; None where no slope is finite.

    cov = H^-1 (sum over blocks of g g') H^-1, g = J' e of a block (Liang and Zeger 1986).
    """
    plant, theta = estimate.plant, estimate.theta
    jacobian = Problem(plant, records, noise).jacobian(theta, estimate.local, plant.free)
    white = noise.whiten(estimate.errors).reshape(len(estimate.local), -1)  # [E, M]
    if not jacobian.finite:
        return None
    normal = NormalEquations.of(jacobian, white)
    h, weights = normal.reduced(0.0)
    # The slopes of theta when the per-experiment numbers follow: J - K (K'K)^-1 K'J.
    own = jacobian.theta - np.einsum("eqp,qem->pem", weights, jacobian.local)
    per_record = max(1, -(-BLOCKS // len(white)))
    parts = np.array_split(own * white, per_record, axis=2)
    g = np.concatenate([part.sum(axis=2).T for part in parts])  # [blocks, p]
    inside = plant.free & (np.diag(normal.h) > 0)
    scale = np.sqrt(np.diag(normal.h)[inside])  # which directions the data tell does not depend on the units
    inverse = np.linalg.pinv(h[np.ix_(inside, inside)] / scale / scale[:, None], rcond=1e-12, hermitian=True)
    used = len(g) / max(1, len(g) - 1)
    moved = (g[:, inside] / scale) @ inverse
    covariance = np.zeros((len(theta), len(theta)))
    covariance[np.ix_(inside, inside)] = used * (moved.T @ moved) / scale / scale[:, None]
    return Uncertainty(covariance, max(2, len(g) - 1))
