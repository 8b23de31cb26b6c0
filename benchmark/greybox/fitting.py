"""Fitting theta, and the start of every experiment, to the simulation error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from simgap.greybox.noise import Noise
from simgap.greybox.plant import Structure
from simgap.greybox.simulation import Simulator
from simgap.records import Experiment

LARGEST_ERROR = 1e60  # of a simulation that grows without bound; its square is still a number
DIFFERENCE = 1e-5  # of a parameter's size: the step of its numerical slope


@dataclass(frozen=True, eq=False)
class Records:
    """Experiments side by side; the shorter ones are padded with their last input and masked."""

    u: Float[np.ndarray, "E T nu"]
    y: Float[np.ndarray, "E T ny"]
    mask: Bool[np.ndarray, "E T"]
    dt: float

    @classmethod
    def of(cls, experiments: Sequence[Experiment], outputs: Sequence[int]) -> Records:
        """The chosen outputs of these experiments."""
        longest = max(map(len, experiments))

        def padded(values: np.ndarray) -> np.ndarray:
            return np.concatenate((values, np.repeat(values[-1:], longest - len(values), axis=0)))

        return cls(
            np.stack([padded(x.u) for x in experiments]),
            np.stack([padded(x.y[:, list(outputs)]) for x in experiments]),
            np.stack([np.arange(longest) < len(x) for x in experiments]),
            experiments[0].dt,
        )

    @property
    def duration(self) -> float:
        """Of the longest experiment, in s."""
        return self.dt * self.mask.shape[1]

    @property
    def samples(self) -> int:
        """Measured samples of each output."""
        return int(self.mask.sum())

    @cached_property
    def weights(self) -> Float[np.ndarray, "E T 1"]:
        """1 where something was measured."""
        return self.mask[:, :, None].astype(float)


@dataclass(frozen=True, eq=False)
class Slopes:
    """d(simulation)/d(parameter), whitened: of theta [p, E, M], of the local numbers [q, E, M]."""

    theta: Float[np.ndarray, "p E M"]
    local: Float[np.ndarray, "q E M"]


@dataclass(frozen=True, eq=False)
class Estimate:
    """Where a search ended: theta, the local numbers, the errors there, and what the data say of theta."""

    structure: Structure
    theta: Float[np.ndarray, " p"]
    local: Float[np.ndarray, "E q"]
    errors: Float[np.ndarray, "E T ny"]
    squares: float
    converged: bool


class Problem:
    """One structure before the records that it is fitted to."""

    def __init__(self, structure: Structure, records: Records, noise: Noise) -> None:
        self.structure, self.records, self.noise = structure, records, noise
        self.simulator = Simulator(structure, records.u)
        self._spread = np.std(records.y[records.mask], axis=0) + 1e-12

    def errors(self, theta: np.ndarray, local: np.ndarray) -> Float[np.ndarray, "E T ny"]:
        """Measured minus simulated; 0 where nothing was measured, and never beyond a bound."""
        errors = (self.records.y - self.simulator.run(theta, local)) * self.records.weights
        if not np.max(np.abs(errors), initial=0.0) < LARGEST_ERROR:  # nor when it is not a number
            errors = np.clip(np.nan_to_num(errors, nan=LARGEST_ERROR), -LARGEST_ERROR, LARGEST_ERROR)
        return errors

    def squares(self, errors: np.ndarray) -> float:
        """The sum of squares of the whitened errors."""
        white = self.noise.whiten(errors)
        value = float(np.vdot(white, white))
        return value if np.isfinite(value) else np.inf

    def first_guess(self, theta: np.ndarray) -> Float[np.ndarray, "E q"]:
        """Local numbers of a machine that stood at its first reading."""
        structure, first = self.structure, self.records.y[:, 0]
        local = np.zeros((len(first), structure.n_local))
        if structure.cascade:
            local[:, structure.order - 1] = first[:, 0]
            for i in range(structure.order - 2, -1, -1):
                rate = theta[i] if theta[i] > 0 else 1.0
                local[:, i] = local[:, i + 1] * theta[i + 1] / rate
        else:
            local[:, 0] = first[:, 0]
        return local

    def other_side(self, theta: np.ndarray, local: np.ndarray) -> Float[np.ndarray, "E q"]:
        """Local numbers with the start, or the first reading, on the side of zero that suits each experiment better.

        A reading without a sign does not tell the two apart, and no descent leads from one to the other.
        """
        sides = np.ones(local.shape[1])
        sides[: self.structure.order] = -1
        guess = local.copy()
        guess[:, : self.structure.order] = self.first_guess(theta)[:, : self.structure.order]
        starts = np.stack([local, local * sides, guess, guess * sides])  # [4, E, q]
        squares = [np.sum(self.noise.whiten(self.errors(theta, start)) ** 2, axis=(1, 2)) for start in starts]
        return starts[np.argmin(squares, axis=0), np.arange(len(local))]

    def slopes(self, theta: np.ndarray, local: np.ndarray, which: np.ndarray) -> Slopes:
        """Slopes of the simulation by forward differences, for the parameters `which` of theta."""
        structure, which = self.structure, np.flatnonzero(which)
        sizes, high = self.sizes(theta), structure.high
        steps = [DIFFERENCE * sizes[i] * (1 if theta[i] + DIFFERENCE * sizes[i] <= high[i] else -1) for i in which]
        starts = [DIFFERENCE * self._spread[0] * (structure.dt**-i if not structure.cascade else 1.0)
                  for i in range(structure.order)]  # fmt: skip
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
        of_local = np.zeros((structure.n_local, len(here), m))
        for i, (moved, step) in enumerate(zip(there[len(steps) :], starts, strict=True)):
            of_local[i] = slope(moved, step)
        for i, term in enumerate(structure.local, start=structure.order):
            step = self._spread[term.channel] / self.records.duration
            moved = local.copy()
            moved[:, i] += step
            of_local[i] = slope(self.simulator.run(theta, moved), step)
        return Slopes(of_theta, of_local)

    def sizes(self, theta: np.ndarray) -> Float[np.ndarray, " p"]:
        """How large a change of each parameter is worth talking about."""
        structure = self.structure
        sizes = np.maximum(np.abs(theta), 1e-3 * np.max(np.abs(theta[: structure.n_plant]), initial=1e-6))
        for term in structure.terms:
            if term in structure.local:
                continue
            at = structure.term_at(term)
            starts = [abs(np.array(start.values)) for start in structure.starts_of(term)]
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
        """Levenberg-Marquardt within the bounds; each experiment's own numbers are eliminated from every step.

        It ends when the gain that the quadratic model promises is below `tolerance` of the variance of the noise,
        so that twice the log-likelihood is known to about `tolerance`.
        """
        structure = self.structure
        low, high = structure.low, structure.high
        free = structure.free if fixed is None else structure.free & ~fixed
        theta = np.clip(theta, low, high)
        local = self.first_guess(theta) if local is None else local.copy()
        if structure.signless:
            local = self.other_side(theta, local)
        errors = self.errors(theta, local)
        squares, damping, converged = self.squares(errors), 1e-3, False
        experiments = len(local)
        for _ in range(max_steps if np.isfinite(squares) else 0):
            slopes = self.slopes(theta, local, free)
            if not (np.isfinite(slopes.theta).all() and np.isfinite(slopes.local).all()):
                break
            white = self.noise.whiten(errors).reshape(experiments, -1)  # [E, M]
            normal = _Normal.of(slopes, white)
            inside = free & ~((theta <= low) & (normal.gradient < 0)) & ~((theta >= high) & (normal.gradient > 0))
            step, promised = normal.step(inside, 1e-9)
            if not promised > tolerance * squares / max(1, self.records.samples * structure.ny):
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
        return Estimate(structure, theta, local, errors, squares, converged)

    def information(self, found: Estimate) -> Float[np.ndarray, "p p"]:
        """J' J of theta, less what the local numbers take of it."""
        slopes = self.slopes(found.theta, found.local, self.structure.free)
        white = self.noise.whiten(found.errors).reshape(len(found.local), -1)
        return _Normal.of(slopes, white).information


@dataclass(frozen=True, eq=False)
class _Normal:
    """Normal equations with one block per experiment."""

    h: Float[np.ndarray, "p p"]
    gradient: Float[np.ndarray, " p"]
    cross: Float[np.ndarray, "E p q"]
    blocks: Float[np.ndarray, "E q q"]
    block_gradient: Float[np.ndarray, "E q"]

    @classmethod
    def of(cls, slopes: Slopes, white: np.ndarray) -> _Normal:
        j, k = slopes.theta.swapaxes(0, 1), slopes.local.swapaxes(0, 1)  # [E, p, M], [E, q, M]
        jt, kt = j.swapaxes(1, 2), k.swapaxes(1, 2)
        e = white[:, :, None]
        return cls((j @ jt).sum(0), (j @ e).sum(0)[:, 0], j @ kt, k @ kt, (k @ e)[:, :, 0])

    def _reduced(self, damping: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        blocks = self.blocks.copy()
        i = np.arange(blocks.shape[1])
        blocks[:, i, i] = blocks[:, i, i] * (1 + damping) + 1e-12 * np.max(blocks, axis=(1, 2))[:, None] + 1e-300
        weights = np.linalg.solve(blocks, self.cross.swapaxes(1, 2))  # [E, q, p]
        starts = np.linalg.solve(blocks, self.block_gradient[:, :, None])[:, :, 0]  # [E, q]
        h = self.h - (self.cross @ weights).sum(0)
        return h, weights, starts

    @property
    def information(self) -> np.ndarray:
        """What is left of J' J for theta when the local numbers are estimated along."""
        return self._reduced(0.0)[0]

    def step(self, inside: np.ndarray, damping: float) -> tuple[tuple[np.ndarray, np.ndarray], float]:
        """The damped step of theta and of the local numbers, and the gain it promises."""
        h, weights, starts = self._reduced(damping)
        gradient = self.gradient - (self.cross @ starts[:, :, None]).sum(0)[:, 0]
        scale = np.sqrt(np.maximum(np.diag(self.h), 1e-300))
        matrix = (h / scale / scale[:, None])[np.ix_(inside, inside)] + (damping + 1e-11) * np.eye(inside.sum())
        step = np.zeros(len(gradient))
        if inside.any():
            step[inside] = np.linalg.lstsq(matrix, (gradient / scale)[inside], rcond=1e-13)[0] / scale[inside]
        local = starts - weights @ step
        promised = float(step @ gradient + np.sum(starts * self.block_gradient))
        return (step, local), promised
