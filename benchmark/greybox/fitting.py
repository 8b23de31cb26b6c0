"""Fit theta, and the initial state of every experiment, to the simulation error."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float

from simgap.cores import on_cores
from simgap.greybox.levenberg import minimise
from simgap.greybox.normal_equations import LARGEST_SLOPE, Jacobian, NormalEquations
from simgap.greybox.plant import Plant
from simgap.greybox.problem import Problem

MAX_STEPS = 40
TOLERANCE = 1e-3  # of the variance of the errors: the gain that is not worth another step


@dataclass(frozen=True, eq=False)
class Estimate:
    """Where a fit ended: theta, the numbers of each experiment (initial state, then its own parameters), the errors."""

    plant: Plant
    theta: Float[np.ndarray, " p"]
    local: Float[np.ndarray, "E q"]
    errors: Float[np.ndarray, "E T ny"]
    squares: float
    converged: bool

    @property
    def of_all(self) -> Estimate:
        """The same without what belongs to single experiments; the errors are still those beside it."""
        plant = self.plant.of_all
        theta, local = plant.carry(self.plant, self.theta, self.local)
        return replace(self, plant=plant, theta=theta, local=local)


def descend(
    problem: Problem,
    theta: np.ndarray,
    local: np.ndarray | None = None,
    fixed: np.ndarray | None = None,
    max_steps: int = MAX_STEPS,
    tolerance: float = TOLERANCE,
) -> Estimate:
    """Fit theta and the numbers of each experiment by Levenberg-Marquardt, within the bounds.

    Where all of theta is `fixed`, every experiment is a fit of its own, so that none changes another's. A fit ends
    when the gain that the quadratic model promises is below `tolerance` of the variance of the noise, so that
    twice the log-likelihood is known to about `tolerance`. Readings in steps are fitted by the quantity that is read:
    their squares are flat between jumps, and would be the least where chance has turned the fewest readings wrong.
    """
    plant = problem.plant
    free = plant.free if fixed is None else plant.free & ~fixed
    theta = np.clip(theta, plant.low, plant.high)
    local = problem.at_rest(theta) if local is None else local.copy()
    if plant.sign_hidden:
        local = problem.other_side(theta, local)
    if any(not term.effect.linear for term in plant.remembered) and not plant.imposed:
        local = problem.better_start(theta, local)
    descent = _Together(problem, theta, local, free) if free.any() else _OneByOne(problem, theta, local)
    converged = minimise(descent, max_steps, tolerance)
    errors = problem.errors(descent.theta, descent.local) if plant.reads_in_steps else descent.errors
    squares = problem.squares(errors)
    return Estimate(plant, descent.theta, descent.local, errors, squares, bool(converged.all()))


def best_descent(
    problem: Problem,
    starts: Iterable[tuple[np.ndarray, np.ndarray | None]],
    max_steps: int = MAX_STEPS,
    tolerance: float = TOLERANCE,
) -> Estimate:
    """Fit from each of several starts, side by side, and return the best."""
    fits = on_cores(partial(_from_start, problem, max_steps, tolerance), list(starts))
    return min(fits, key=lambda fit: fit.squares)


def _from_start(
    problem: Problem, max_steps: int, tolerance: float, start: tuple[np.ndarray, np.ndarray | None]
) -> Estimate:
    return descend(problem, *start, max_steps=max_steps, tolerance=tolerance)


class _Together:
    """The descent of theta and of the numbers of all experiments: one group."""

    def __init__(self, problem: Problem, theta: np.ndarray, local: np.ndarray, free: np.ndarray) -> None:
        self.problem, self.theta, self.local, self.free = problem, theta, local, free
        self.errors = problem.errors(theta, local, steps=False)
        self.squares = np.array([problem.squares(self.errors)])
        self.samples = np.array([problem.records.samples * problem.plant.ny])

    def linearise(self, groups: np.ndarray) -> Float[np.ndarray, " 1"]:
        """Compute the normal equations and the gain that they promise."""
        problem, theta = self.problem, self.theta
        jacobian = problem.jacobian(theta, self.local, self.free)
        if not jacobian.finite:
            return np.array([np.nan])
        white = problem.noise.whiten(self.errors).reshape(len(self.local), -1)  # [E, M]
        self._normal = normal = NormalEquations.of(jacobian, white)
        outwards = (theta <= problem.plant.low) & (normal.gradient < 0)
        outwards |= (theta >= problem.plant.high) & (normal.gradient > 0)
        self._inside = self.free & ~outwards
        return np.array([normal.step(self._inside, 1e-9)[1]])

    def attempt(self, groups: np.ndarray, damping: Float[np.ndarray, " 1"]) -> Float[np.ndarray, " 1"]:
        """Compute the squares after a damped step."""
        (step, local_step), _ = self._normal.step(self._inside, float(damping[0]))
        theta = np.clip(self.theta + step, self.problem.plant.low, self.problem.plant.high)
        local = self.problem.within_reach(self.local + local_step)
        errors = self.problem.errors(theta, local, steps=False)
        self._attempted = theta, local, errors
        return np.array([self.problem.squares(errors)])

    def accept(self, groups: np.ndarray, squares: np.ndarray) -> None:
        """Take the step that was attempted."""
        if len(groups):
            self.theta, self.local, self.errors = self._attempted
            self.squares = squares


class _OneByOne:
    """The descents of the numbers of each experiment, side by side; theta stays as it is."""

    def __init__(self, problem: Problem, theta: np.ndarray, local: np.ndarray) -> None:
        self.problem, self.theta, self.local = problem, theta, local
        self.errors = problem.errors(theta, local, steps=False)
        self.squares = problem.squares_of_each(self.errors)
        self.samples = np.maximum(1, problem.records.mask.sum(axis=1)) * problem.plant.ny

    def linearise(self, groups: np.ndarray) -> Float[np.ndarray, " G"]:
        """Compute the normal equations of these experiments and the gains that they promise."""
        problem = self.problem.only(groups)
        jacobian = problem.jacobian(self.theta, self.local[groups], np.zeros(len(self.theta), dtype=bool))
        usable = np.max(np.abs(jacobian.local), axis=(0, 2), initial=0.0) < LARGEST_SLOPE  # nor is NaN
        jacobian = Jacobian(np.where(usable[:, None], jacobian.local, 0.0), 0)
        white = problem.noise.whiten(self.errors[groups]).reshape(len(groups), -1)  # [G, M]
        self._groups, self._normal = groups, NormalEquations.of(jacobian, white)
        return np.where(usable, self._normal.promised_by_each(), np.nan)

    def attempt(self, groups: np.ndarray, damping: Float[np.ndarray, " G"]) -> Float[np.ndarray, " G"]:
        """Compute the squares of these experiments after damped steps."""
        normal = self._normal.only(np.searchsorted(self._groups, groups))
        problem = self.problem.only(groups)
        local = problem.within_reach(self.local[groups] + normal.steps_of_each(damping))
        errors = problem.errors(self.theta, local, steps=False)
        squares = problem.squares_of_each(errors)
        self._attempted = groups, local, errors
        return squares

    def accept(self, groups: np.ndarray, squares: np.ndarray) -> None:
        """Take the steps of these experiments."""
        attempted, local, errors = self._attempted
        rows = np.searchsorted(attempted, groups)
        self.local[groups], self.errors[groups], self.squares[groups] = local[rows], errors[rows], squares
