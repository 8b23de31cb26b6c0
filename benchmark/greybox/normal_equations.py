"""Normal equations of a fit; the numbers of single experiments are eliminated block by block."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from simgap.greybox.elimination_kernels import damped_step, eliminate, solve_blocks

LARGEST_SLOPE = 1e100  # its square is still a number


@dataclass(frozen=True, eq=False)
class Jacobian:
    """d(simulation)/d(parameter), whitened: of theta [p, E, M], then of the numbers of each experiment [q, E, M]."""

    slopes: Float[np.ndarray, "p+q E M"]
    p: int

    @classmethod
    def of(cls, theta: Float[np.ndarray, "p E M"], local: Float[np.ndarray, "q E M"]) -> Jacobian:
        return cls(np.concatenate((theta, local)), len(theta))

    @property
    def theta(self) -> Float[np.ndarray, "p E M"]:
        """The slopes of theta."""
        return self.slopes[: self.p]

    @property
    def local(self) -> Float[np.ndarray, "q E M"]:
        """The slopes of the numbers of each experiment."""
        return self.slopes[self.p :]

    @property
    def finite(self) -> bool:
        """Whether all slopes are numbers, and their squares too."""
        return bool(np.max(np.abs(self.slopes), initial=0.0) < LARGEST_SLOPE)


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
        p, slopes = jacobian.p, jacobian.slopes.swapaxes(0, 1)  # [E, p + q, M]
        h = slopes @ slopes.swapaxes(1, 2)
        nothing = np.empty(0)
        equations = cls(h[:, :p, :p].sum(0), nothing, h[:, :p, p:].copy(), h[:, p:, p:].copy(), nothing)
        return equations.with_errors(jacobian, white)

    def with_errors(self, jacobian: Jacobian, white: Float[np.ndarray, "E M"]) -> NormalEquations:
        """Return the equations of the same slopes for other errors."""
        gradient = (jacobian.slopes.swapaxes(0, 1) @ white[:, :, None])[:, :, 0]  # [E, p + q]
        p = jacobian.p
        return replace(self, gradient=gradient[:, :p].sum(0), block_gradient=gradient[:, p:].copy())

    def only(self, experiments: np.ndarray) -> NormalEquations:
        """Return the equations of some experiments, theta being known."""
        return replace(
            self, cross=self.cross[experiments], blocks=self.blocks[experiments],
            block_gradient=self.block_gradient[experiments],
        )  # fmt: skip

    def steps_of_each(self, damping: float | np.ndarray) -> Float[np.ndarray, "E q"]:
        """Compute the damped steps of the per-experiment numbers, theta being known."""
        steps = self.block_gradient[:, :, None].copy()
        solve_blocks(self.blocks, steps, np.full(len(steps), damping))
        return steps[:, :, 0]

    def promised_by_each(self) -> Float[np.ndarray, " E"]:
        """Compute the gain that a whole step of each experiment promises, theta being known."""
        return np.sum(self.steps_of_each(1e-9) * self.block_gradient, axis=1)

    def reduced(self, damping: float) -> tuple[np.ndarray, np.ndarray]:
        """Eliminate the per-experiment numbers: J' J of theta, and what turns steps of theta into theirs [E, q, p]."""
        h, gradient = np.empty_like(self.h), np.empty_like(self.gradient)
        solved = np.empty((*self.block_gradient.shape, len(h) + 1))
        eliminate(self.h, self.gradient, self.cross, self.blocks, self.block_gradient, damping, h, gradient, solved)
        return h, solved[:, :, :-1]

    def step(self, inside: np.ndarray, damping: float) -> tuple[tuple[np.ndarray, np.ndarray], float]:
        """Compute the damped step of theta and of the per-experiment numbers, and the gain it promises."""
        step, local = np.empty_like(self.gradient), np.empty_like(self.block_gradient)
        promised = damped_step(
            self.h, self.gradient, self.cross, self.blocks, self.block_gradient, inside, damping, step, local
        )
        return (step, local), promised


def scales_of(diagonal: np.ndarray) -> np.ndarray:
    """Take the roots of a diagonal of sums of squares; 1 for what moves nothing."""
    return np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
