"""How well the data fix the parameters of a plant: the covariance of their estimate."""

from __future__ import annotations

import math
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
MOST = 0.999  # of what tells a number: the share of one block


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """The covariance of the estimate of theta, from so many degrees of freedom; 0 for what is not estimated."""

    covariance: Float[np.ndarray, "p p"]
    freedom: float

    def reach(self, level: float = 0.95) -> Float[np.ndarray, " p"]:
        """Return the half width of the interval of each parameter, by Student's t."""
        deviations = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        return float(student.ppf(0.5 + level / 2, self.freedom)) * deviations


def uncertainty(estimate: Estimate, noise: Noise, records: Records) -> Uncertainty | None:
    """Compute it, honest for coloured errors and for what the model cannot explain; None where no slope is finite.

        cov = H^-1 (sum over blocks of g g') H^-1,   g = J' (I - P)^-1/2 e of a block

    P is the block's share of the projection onto all slopes: where a few samples tell most of a number, the fit has
    made their errors small (Liang and Zeger 1986; Bell and McCaffrey, Survey Methodology 28, 2002, CR2). Where so few
    blocks tell it that their sum is chance, it is smaller than the s^2 H^-1 of white errors, and then that counts.
    Blocks of unequal records hold unequal numbers of samples: with their shares w there are 1 / sum(w^2) - 1 degrees of
    freedom (Carter, Schnepel and Steigerwald, Review of Economics and Statistics 99, 2017).
    """
    plant, theta = estimate.plant, estimate.theta
    problem = Problem(plant, records, noise)
    jacobian = problem.jacobian(theta, estimate.local, plant.free)
    errors = problem.errors(theta, estimate.local, steps=False) if plant.reads_in_steps else estimate.errors
    white = noise.whiten(errors).reshape(len(estimate.local), -1)  # [E, M]
    if not jacobian.finite:
        return None
    normal = NormalEquations.of(jacobian, white)
    h, weights = normal.reduced(0.0)
    inside = plant.free & (np.diag(normal.h) > 0)
    scale = np.sqrt(np.diag(normal.h)[inside])  # which directions the data tell does not depend on the units
    # The slopes of theta when the per-experiment numbers follow: J - K (K'K)^-1 K'J.
    own = jacobian.theta[inside] - np.einsum("eqp,qem->pem", weights[:, :, inside], jacobian.local)
    own /= scale[:, None, None]
    root, of_own = _inverse_root(h[np.ix_(inside, inside)] / scale / scale[:, None]), _inverse_root(normal.blocks)
    columns = np.einsum("pem,pr->erm", own, root), np.einsum("qem,eqr->erm", jacobian.local, of_own)
    projected = np.concatenate(columns, axis=1)  # P = A' A, A [E, r, M]
    g, samples = [], []
    measured = np.repeat(records.mask, plant.ny, axis=1)  # [E, M]
    for at in np.array_split(np.arange(white.shape[1]), math.ceil(BLOCKS * white.shape[1] / measured.sum())):
        a = projected[:, :, at]
        share, along = np.linalg.eigh(a @ a.swapaxes(1, 2))
        of_block = (along.swapaxes(1, 2) @ (a @ white[:, at, None]))[:, :, 0]
        of_block /= np.sqrt(1 - np.minimum(share, MOST))
        g.append((along @ of_block[:, :, None])[:, : len(root), 0])
        samples.append(measured[:, at].sum(axis=1))
    moved = np.concatenate(g) @ root / scale  # [blocks, p]
    share = np.concatenate(samples) / measured.sum()
    freedom = max(1, records.samples * plant.ny - int(inside.sum()) - estimate.local.size)
    of_white = float(np.vdot(white, white)) / freedom * np.sum((root / scale) ** 2, axis=0)
    of_blocks = np.sum(moved**2, axis=0)
    wider = np.sqrt(np.maximum(1.0, of_white / np.where(of_blocks > 0, of_blocks, np.inf)))
    covariance = np.zeros((len(theta), len(theta)))
    covariance[np.ix_(inside, inside)] = (moved * wider).T @ (moved * wider)
    return Uncertainty(covariance, max(2.0, 1 / np.sum(share**2) - 1))


def _inverse_root(h: Float[np.ndarray, "... n n"]) -> Float[np.ndarray, "... n n"]:
    """Compute h^-1/2, without the directions in which h is nothing."""
    size, along = np.linalg.eigh(h)
    least = 1e-12 * np.max(size, axis=-1, initial=0.0, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.where(size > least, size**-0.5, 0.0)
    return (along * root[..., None, :]) @ along.swapaxes(-1, -2)
