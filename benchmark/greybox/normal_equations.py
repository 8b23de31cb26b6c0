"""Normal equations of a fit; the numbers of single experiments are eliminated block by block."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

LARGEST_SLOPE = 1e100  # its square is still a number


@dataclass(frozen=True, eq=False)
class Jacobian:
    """d(simulation)/d(parameter), whitened: of theta [p, E, M], and of the numbers of each experiment [q, E, M]."""

    theta: Float[np.ndarray, "p E M"]
    local: Float[np.ndarray, "q E M"]

    @property
    def finite(self) -> bool:
        """Whether all slopes are numbers, and their squares too."""
        return bool(
            np.max(np.abs(self.theta), initial=0.0) < LARGEST_SLOPE
            and np.max(np.abs(self.local), initial=0.0) < LARGEST_SLOPE
        )


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Normal equations of theta, with one block of per-experiment numbers for each experiment."""

    h: Float[np.ndarray, "p p"]
    gradient: Float[np.ndarray, " p"]
    cross: Float[np.ndarray, "E p q"]
    blocks: Float[np.ndarray, "E q q"]
    block_gradient: Float[np.ndarray, "E q"]

    @classmethod
    def of(cls, jacobian: Jacobian, white: np.ndarray) -> NormalEquations:
        j, k = jacobian.theta.swapaxes(0, 1), jacobian.local.swapaxes(0, 1)  # [E, p, M], [E, q, M]
        jt, kt = j.swapaxes(1, 2), k.swapaxes(1, 2)
        e = white[:, :, None]
        return cls((j @ jt).sum(0), (j @ e).sum(0)[:, 0], j @ kt, k @ kt, (k @ e)[:, :, 0])

    def only(self, experiments: np.ndarray) -> NormalEquations:
        """Return the equations of some experiments, theta being known."""
        return replace(
            self, cross=self.cross[experiments], blocks=self.blocks[experiments],
            block_gradient=self.block_gradient[experiments],
        )  # fmt: skip

    def steps_of_each(self, damping: float | np.ndarray) -> Float[np.ndarray, "E q"]:
        """Compute the damped steps of the per-experiment numbers, theta being known."""
        return self._solved(self.block_gradient[:, :, None], damping)[:, :, 0]

    def promised_by_each(self) -> Float[np.ndarray, " E"]:
        """Compute the gain that a whole step of each experiment promises, theta being known."""
        return np.sum(self.steps_of_each(1e-9) * self.block_gradient, axis=1)

    def _solved(self, right: Float[np.ndarray, "E q k"], damping: float | np.ndarray) -> Float[np.ndarray, "E q k"]:
        """Solve the damped blocks, each number in units of its own slope: then none of them is singular."""
        i = np.arange(self.blocks.shape[1])
        scale = scales_of(self.blocks[:, i, i])[:, :, None]  # [E, q, 1]
        blocks = self.blocks / scale / scale.swapaxes(1, 2)
        blocks[:, i, i] = 1 + np.reshape(damping, (-1, 1)) + 1e-12
        return np.linalg.solve(blocks, right / scale) / scale

    def reduced(self, damping: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Eliminate the per-experiment numbers: J' J of theta, and what turns steps of theta into theirs."""
        weights = self._solved(self.cross.swapaxes(1, 2), damping)  # [E, q, p]
        starts = self.steps_of_each(damping)  # [E, q]
        h = self.h - (self.cross @ weights).sum(0)
        return h, weights, starts

    def step(self, inside: np.ndarray, damping: float) -> tuple[tuple[np.ndarray, np.ndarray], float]:
        """Compute the damped step of theta and of the per-experiment numbers, and the gain it promises."""
        h, weights, starts = self.reduced(damping)
        gradient = self.gradient - (self.cross @ starts[:, :, None]).sum(0)[:, 0]
        scale = scales_of(np.diag(self.h))
        matrix = (h / scale / scale[:, None])[inside][:, inside]
        matrix.flat[:: len(matrix) + 1] += damping + 1e-11
        step = np.zeros(len(gradient))
        if inside.any():
            step[inside] = np.linalg.lstsq(matrix, (gradient / scale)[inside], rcond=1e-13)[0] / scale[inside]
        local = starts - weights @ step
        promised = float(step @ gradient + np.sum(starts * self.block_gradient))
        return (step, local), promised


def scales_of(diagonal: np.ndarray) -> np.ndarray:
    """Take the roots of a diagonal of sums of squares; 1 for what moves nothing."""
    return np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
