"""Fit theta, and the initial state of every experiment, to the simulation error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simgap.greybox.levenberg import minimise
from simgap.greybox.noise import Noise
from simgap.greybox.normal_equations import Jacobian, NormalEquations
from simgap.greybox.plant import Plant
from simgap.greybox.samples import Records
from simgap.greybox.simulation import Simulator

LARGEST_ERROR = 1e60  # of a simulation that grows without bound; its square is still a number
DIFFERENCE = 1e-5  # of a parameter's size: the step of its numerical slope
INITIAL_STEPS = 15


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
        # Finite differences are in proportion to the readings in training, not to those of the few samples at hand.
        spread = [s.y_rms for s in plant.scales.outputs] if plant.scales else np.std(records.y[records.mask], axis=0)
        self._spread = np.asarray(spread) + 1e-12

    def only(self, experiments: np.ndarray) -> Problem:
        """Return the same problem for some of the experiments."""
        return (
            self
            if len(experiments) == len(self.records.u)
            else Problem(self.plant, self.records.only(experiments), self.noise)
        )

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

    def squares_of_each(self, errors: np.ndarray) -> Float[np.ndarray, " E"]:
        """Sum the squares of the whitened errors of each experiment."""
        return np.sum(self.noise.whiten(errors) ** 2, axis=(1, 2))

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
        squares = [self.squares_of_each(self.errors(theta, start)) for start in starts]
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
        """Fit theta and the numbers of each experiment by Levenberg-Marquardt, within the bounds.

        Where all of theta is `fixed`, every experiment is a fit of its own, so that none changes another's. A fit ends
        when the gain that the quadratic model promises is below `tolerance` of the variance of the noise, so that
        twice the log-likelihood is known to about `tolerance`.
        """
        plant = self.plant
        free = plant.free if fixed is None else plant.free & ~fixed
        theta = np.clip(theta, plant.low, plant.high)
        local = self.at_rest(theta) if local is None else local.copy()
        if plant.sign_hidden:
            local = self.other_side(theta, local)
        descent = _Together(self, theta, local, free) if free.any() else _OneByOne(self, theta, local)
        converged = minimise(descent, max_steps, tolerance)
        squares = self.squares(descent.errors)
        return Estimate(plant, descent.theta, descent.local, descent.errors, squares, bool(converged.all()))


class _Together:
    """The descent of theta and of the numbers of all experiments: one group."""

    def __init__(self, problem: Problem, theta: np.ndarray, local: np.ndarray, free: np.ndarray) -> None:
        self.problem, self.theta, self.local, self.free = problem, theta, local, free
        self.errors = problem.errors(theta, local)
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
        local = self.local + local_step
        errors = self.problem.errors(theta, local)
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
        self.errors = problem.errors(theta, local)
        self.squares = problem.squares_of_each(self.errors)
        self.samples = np.maximum(1, problem.records.mask.sum(axis=1)) * problem.plant.ny

    def linearise(self, groups: np.ndarray) -> Float[np.ndarray, " G"]:
        """Compute the normal equations of these experiments and the gains that they promise."""
        problem = self.problem.only(groups)
        jacobian = problem.jacobian(self.theta, self.local[groups], np.zeros(len(self.theta), dtype=bool))
        white = problem.noise.whiten(self.errors[groups]).reshape(len(groups), -1)  # [G, M]
        self._groups, self._normal = groups, NormalEquations.of(jacobian, white)
        usable = np.isfinite(self._normal.blocks).all(axis=(1, 2))
        promised = np.full(len(groups), np.nan)
        promised[usable] = self._normal.only(usable).promised_by_each()
        return promised

    def attempt(self, groups: np.ndarray, damping: Float[np.ndarray, " G"]) -> Float[np.ndarray, " G"]:
        """Compute the squares of these experiments after damped steps."""
        normal = self._normal.only(np.searchsorted(self._groups, groups))
        problem = self.problem.only(groups)
        local = self.local[groups] + normal.steps_of_each(damping)
        errors = problem.errors(self.theta, local)
        squares = problem.squares_of_each(errors)
        self._attempted = groups, local, errors
        return squares

    def accept(self, groups: np.ndarray, squares: np.ndarray) -> None:
        """Take the steps of these experiments."""
        attempted, local, errors = self._attempted
        rows = np.searchsorted(attempted, groups)
        self.local[groups], self.errors[groups], self.squares[groups] = local[rows], errors[rows], squares


def initial_states(
    plant: Plant,
    theta: Float[np.ndarray, " p"],
    u: Float[np.ndarray, "B n nu"],
    y: Float[np.ndarray, "B n ny"],
    noise: Noise,
) -> Float[np.ndarray, "B q"]:
    """Find the states at the first sample of each record from its n measured samples; the model is known."""
    records = Records(np.ascontiguousarray(u), y, np.ones(y.shape[:2], dtype=bool), plant.dt)
    fixed = np.ones(plant.size, dtype=bool)
    return Problem(plant, records, noise).fit(theta, fixed=fixed, max_steps=INITIAL_STEPS).local
