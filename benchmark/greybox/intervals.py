"""Intervals of the parameters of a fitted plant."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.stats import t as student

from simgap.greybox.model import FittedPlant
from simgap.greybox.normal_equations import NormalEquations
from simgap.greybox.problem import Problem

BLOCKS = 40


def intervals(fitted: FittedPlant) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """Compute 95 % intervals of theta, honest for coloured errors and for what the model cannot explain.

    cov = H^-1 (sum over blocks of g g') H^-1, g = J' e of a block (Liang and Zeger 1986); Student's t.
    """
    estimate, noise = fitted.estimate, fitted.noise
    plant, theta = estimate.plant, estimate.theta
    jacobian = Problem(plant, fitted.records, noise).jacobian(theta, estimate.local, plant.free)
    white = noise.whiten(estimate.errors).reshape(len(estimate.local), -1)  # [E, M]
    if not jacobian.finite:
        return plant.low, plant.high
    normal = NormalEquations.of(jacobian, white)
    h, weights, _ = normal.reduced(0.0)
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
    reach = np.full(len(theta), 0.0)
    deviations = np.sqrt(used * np.sum(moved**2, axis=0)) / scale
    reach[inside] = student.ppf(0.975, max(2, len(g) - 1)) * deviations
    return np.maximum(theta - reach, plant.low), np.minimum(theta + reach, plant.high)
