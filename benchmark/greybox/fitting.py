"""Fit theta, and the initial state of every experiment, to the simulation error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simgap.greybox.noise import Noise
from simgap.greybox.normal_equations import Jacobian, NormalEquations
from simgap.greybox.plant import Plant
from simgap.greybox.samples import Records
from simgap.greybox.simulation import Simulator

LARGEST_ERROR = 1e60  # of a simulation that grows without bound; its square is still a number
DIFFERENCE = 1e-5  # of a parameter's size: the step of its numerical slope


@dataclass(frozen=True, eq=False)
class Estimate:
    """Where a fit ended: theta, the numbers of each experiment (initial state, then its own parameters), the errors."""

    plant: Plant
    theta: Float[np.ndarray, " p"]
    local: Float[np.ndarray, "E q"]
    errors: Float[np.ndarray, "E T ny"]
    squares: float
    converged: bool


class Problem:
    """A plant with the records that it is fitted to, and the noise that weighs its errors."""

    def __init__(self, plant: Plant, records: Records, noise: Noise) -> None:
        self.plant, self.records, self.noise = plant, records, noise
        self.simulator = Simulator(plant, records.u)
        self._spread = np.std(records.y[records.mask], axis=0) + 1e-12

    def errors(self, theta: np.ndarray, local: np.ndarray) -> Float[np.ndarray, "E T ny"]:
        """Compute measured minus simulated; 0 where nothing was measured, and never beyond a bound."""
        errors = (self.records.y - self.simulator.run(theta, local)) * self.records.weights
        if not np.max(np.abs(errors), initial=0.0) < LARGEST_ERROR:  # nor when it is not a number
            errors = np.clip(np.nan_to_num(errors, nan=LARGEST_ERROR), -LARGEST_ERROR, LARGEST_ERROR)
        return errors

    def squares(self, errors: np.ndarray) -> float:
        """Sum the squares of the whitened errors."""
        white = self.noise.whiten(errors)
        value = float(np.vdot(white, white))
        return value if np.isfinite(value) else np.inf

    def at_rest(self, theta: np.ndarray) -> Float[np.ndarray, "E q"]:
        """Guess the initial states of a plant that stood at its first reading."""
        plant, first = self.plant, self.records.y[:, 0]
        local = np.zeros((len(first), plant.n_local))
        if plant.cascade:
            local[:, plant.order - 1] = first[:, 0]
            for i in range(plant.order - 2, -1, -1):
                rate = theta[i] if theta[i] > 0 else 1.0
                local[:, i] = local[:, i + 1] * theta[i + 1] / rate
        else:
            local[:, 0] = first[:, 0]
        return local

    def other_side(self, theta: np.ndarray, local: np.ndarray) -> Float[np.ndarray, "E q"]:
        """Put each initial state, or the first reading, on the side of zero that suits the experiment better.

        A reading without a sign does not tell the two apart, and no descent leads from one to the other.
        """
        sides = np.ones(local.shape[1])
        sides[: self.plant.order] = -1
        guess = local.copy()
        guess[:, : self.plant.order] = self.at_rest(theta)[:, : self.plant.order]
        starts = np.stack([local, local * sides, guess, guess * sides])  # [4, E, q]
        squares = [np.sum(self.noise.whiten(self.errors(theta, start)) ** 2, axis=(1, 2)) for start in starts]
        return starts[np.argmin(squares, axis=0), np.arange(len(local))]

    def jacobian(self, theta: np.ndarray, local: np.ndarray, which: np.ndarray) -> Jacobian:
        """Differentiate the simulation by forward differences, for the parameters `which` of theta."""
        plant, which = self.plant, np.flatnonzero(which)
        sizes, high = self.sizes(theta), plant.high
        steps = [DIFFERENCE * sizes[i] * (1 if theta[i] + DIFFERENCE * sizes[i] <= high[i] else -1) for i in which]
        starts = [DIFFERENCE * self._spread[0] * (plant.dt**-i if not plant.cascade else 1.0)
                  for i in range(plant.order)]  # fmt: skip
        thetas = np.repeat(theta[None], 1 + len(steps) + len(starts), axis=0)
        locals_ = np.repeat(local[None], len(thetas), axis=0)
        for row, (i, step) in enumerate(zip(which, steps, strict=True), start=1):
            thetas[row, i] += step
        for i, step in enumerate(starts):
            locals_[1 + len(steps) + i, :, i] += step
        here, *there = self.simulator.run_many(thetas, locals_)
        m = here.shape[1] * here.shape[2]

        def slope(moved: np.ndarray, step: float | np.ndarray) -> np.ndarray:
            change = (moved - here) * (self.records.weights / step)
            return self.noise.whiten(change).reshape(len(here), m)

        of_theta = np.zeros((len(theta), len(here), m))
        for i, moved, step in zip(which, there[: len(steps)], steps, strict=True):
            of_theta[i] = slope(moved, step)
        of_local = np.zeros((plant.n_local, len(here), m))
        for i, (moved, step) in enumerate(zip(there[len(steps) :], starts, strict=True)):
            of_local[i] = slope(moved, step)
        for i, term in enumerate(plant.per_experiment, start=plant.order):
            step = self._spread[term.channel] / self.records.duration
            moved = local.copy()
            moved[:, i] += step
            of_local[i] = slope(self.simulator.run(theta, moved), step)
        return Jacobian(of_theta, of_local)

    def sizes(self, theta: np.ndarray) -> Float[np.ndarray, " p"]:
        """Return the size of each parameter, to which the step of its finite difference is proportional."""
        plant = self.plant
        sizes = np.maximum(np.abs(theta), 1e-3 * np.max(np.abs(theta[: plant.n_linear]), initial=1e-6))
        for term in plant.terms:
            if term in plant.per_experiment:
                continue
            at = plant.part_of(term)
            starts = [abs(np.array(start.values)) for start in plant.starts_of(term)]
            if starts:
                sizes[at] = np.maximum(np.abs(theta[at]), 0.1 * np.median(starts, axis=0) + 1e-12)
        return sizes

    def fit(
        self,
        theta: np.ndarray,
        local: np.ndarray | None = None,
        fixed: np.ndarray | None = None,
        max_steps: int = 40,
        tolerance: float = 1e-3,
    ) -> Estimate:
        """Fit by Levenberg-Marquardt within the bounds; per-experiment numbers are eliminated from every step.

        It ends when the gain that the quadratic model promises is below `tolerance` of the variance of the noise,
        so that twice the log-likelihood is known to about `tolerance`.
        """
        plant = self.plant
        low, high = plant.low, plant.high
        free = plant.free if fixed is None else plant.free & ~fixed
        theta = np.clip(theta, low, high)
        local = self.at_rest(theta) if local is None else local.copy()
        if plant.sign_hidden:
            local = self.other_side(theta, local)
        errors = self.errors(theta, local)
        squares, damping, converged = self.squares(errors), 1e-3, False
        experiments = len(local)
        for _ in range(max_steps if np.isfinite(squares) else 0):
            jacobian = self.jacobian(theta, local, free)
            if not (np.isfinite(jacobian.theta).all() and np.isfinite(jacobian.local).all()):
                break
            white = self.noise.whiten(errors).reshape(experiments, -1)  # [E, M]
            normal = NormalEquations.of(jacobian, white)
            inside = free & ~((theta <= low) & (normal.gradient < 0)) & ~((theta >= high) & (normal.gradient > 0))
            step, promised = normal.step(inside, 1e-9)
            if not promised > tolerance * squares / max(1, self.records.samples * plant.ny):
                converged = True
                break
            while damping < 1e10:
                (step, local_step), _ = normal.step(inside, damping)
                trial = np.clip(theta + step, low, high)
                trial_local = local + local_step
                trial_errors = self.errors(trial, trial_local)
                trial_squares = self.squares(trial_errors)
                if trial_squares < squares:
                    break
                damping = max(damping * 6, 1e-6)
            else:
                converged = True
                break
            crawls = squares - trial_squares < 1e-6 * tolerance * squares
            theta, local, errors, squares = trial, trial_local, trial_errors, trial_squares
            damping = max(damping / 10, 1e-12)
            if crawls:
                converged = True
                break
        return Estimate(plant, theta, local, errors, squares, converged)
