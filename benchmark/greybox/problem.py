"""What a fit minimises: a plant with the records that it simulates, its errors and their slopes."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from jaxtyping import Float

from simgap.greybox import two_masses
from simgap.greybox.noise import Noise
from simgap.greybox.normal_equations import Jacobian
from simgap.greybox.plant import Plant
from simgap.greybox.samples import RESOLUTION, Records
from simgap.greybox.simulation import Simulator

# In sizes of the output: the error of a simulation that grows without bound; its square is still a number.
LARGEST_ERROR = 1e60
SMALL = 1e-3  # share of the size of other numbers that a number near zero counts as
DIFFERENCE = 1e-5  # of a parameter's size: the step of its numerical slope
MEMORIES = np.linspace(-1.0, 1.0, 9)  # from which the memory of a term may begin
SLOWEST = 1e-6  # share of a sample's change by which a tank empties that counts as one at all


def softened(errors: np.ndarray, soft: float) -> np.ndarray:
    """Return z with z^2 = 2 s^2 (sqrt(1 + (e / s)^2) - 1).

    That is e^2 where e is small and 2 s |e| where it is large (a smooth form of Huber, Annals of Math. Stat. 35, 1964).
    """
    with np.errstate(over="ignore"):
        x = errors / soft
        return soft * x * np.sqrt(2.0 / (1.0 + np.sqrt(1.0 + x * x)))


def softness(errors: np.ndarray, soft: float) -> np.ndarray:
    """Compute dz / de of `softened`."""
    with np.errstate(over="ignore", invalid="ignore"):
        root = np.sqrt(1.0 + (errors / soft) ** 2)
        return np.nan_to_num(np.sqrt(0.5 * (1.0 + root)) / root)


class Problem:
    """A plant with the records that it is fitted to, and the noise that weighs its errors."""

    def __init__(self, plant: Plant, records: Records, noise: Noise) -> None:
        self.plant, self.records, self.noise = plant, records, noise
        self.simulator = Simulator(plant, records.u, records.past)
        # The readings in training tell the sizes of the outputs, not the few samples that may be at hand.
        self._sizes = plant.scales.output_sizes[: plant.ny] if plant.scales else records.sizes
        # What rounding adds to the square of each reading: a perfect fit has that, and none is better. [ny]
        self.least = (RESOLUTION * self._sizes / noise.deviations) ** 2
        self._measured = None if records.mask.all() else records.mask[:, :, None]

    def __reduce__(self) -> tuple[type[Problem], tuple[Plant, Records, Noise]]:
        """Be made anew in another process, where compiled loops have other addresses."""
        return Problem, (self.plant, self.records, self.noise)

    def only(self, experiments: np.ndarray) -> Problem:
        """Return the same problem for some of the experiments."""
        return (
            self
            if len(experiments) == len(self.records.u)
            else Problem(self.plant, self.records.only(experiments), self.noise)
        )

    def errors(self, theta: np.ndarray, local: np.ndarray, *, steps: bool = True) -> Float[np.ndarray, "E T ny"]:
        """Compute measured minus simulated; 0 where nothing was measured, and never beyond a bound.

        Without `steps` what is simulated is the quantity before a sensor reads it in steps.
        """
        errors = self._where_measured(self.records.y - self.simulator.run(theta, local, steps=steps))
        if not np.max(np.abs(errors), initial=0.0) < LARGEST_ERROR * self._sizes.min():  # nor when it is not a number
            largest = LARGEST_ERROR * self._sizes
            errors = np.clip(np.where(np.isnan(errors), largest, errors), -largest, largest)
        return softened(errors, self.records.soft) if self.records.soft else errors

    def squares(self, errors: np.ndarray) -> float:
        """Sum the squares of the whitened errors, and what rounding adds to them."""
        white = self.noise.whiten(errors)
        return float(np.vdot(white, white)) + float(self.least.sum()) * self.records.samples

    def squares_of_each(self, errors: np.ndarray) -> Float[np.ndarray, " E"]:
        """Sum the squares of the whitened errors of each experiment."""
        rounding = self.least.sum() * self.records.mask.sum(axis=1)
        return np.sum(self.noise.whiten(errors) ** 2, axis=(1, 2)) + rounding

    def at_rest(self, theta: np.ndarray) -> Float[np.ndarray, "E q"]:
        """Guess the initial states of a plant that stood at its first reading."""
        plant, first = self.plant, self.records.y[:, 0]
        local = np.zeros((len(first), plant.n_local))
        if plant.cascade:
            local[:, plant.order - 1] = first[:, 0]
            for i in range(plant.order - 2, -1, -1):
                rate = max(theta[i], SLOWEST / plant.dt)
                local[:, i] = local[:, i + 1] * theta[i + 1] / rate
        elif plant.order:
            local[:, 0] = first[:, 0]
            if plant.joint:
                local[:, 2] = first[:, 0]
        return local

    def better_start(self, theta: np.ndarray, local: np.ndarray) -> Float[np.ndarray, "E q"]:
        """Let what terms remember begin elsewhere where that suits an experiment better; no descent may lead there."""
        starts = np.stack([local] * (1 + len(MEMORIES)))  # [1 + m, E, q]
        starts[1:, :, self.plant.order : self.plant.n_start] = MEMORIES[:, None, None]
        squares = [self.squares_of_each(self.errors(theta, start)) for start in starts]
        return starts[np.argmin(squares, axis=0), np.arange(len(local))]

    def within_reach(self, local: np.ndarray) -> Float[np.ndarray, "E q"]:
        """Keep what terms remember between -1 and 1; beyond, nothing changes, and a fit would find no way back."""
        remembered = slice(self.plant.order, self.plant.n_start)
        local[:, remembered] = np.clip(local[:, remembered], -1.0, 1.0)
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

    def _where_measured(self, values: Float[np.ndarray, "E T ny"]) -> Float[np.ndarray, "E T ny"]:
        return values if self._measured is None else np.where(self._measured, values, 0.0)

    def jacobian(self, theta: np.ndarray, local: np.ndarray, which: np.ndarray) -> Jacobian:
        """Differentiate the simulation by forward differences, for the parameters `which` of theta.

        Of readings in steps, by those without: small changes would move none of them, or one by a whole step.
        """
        which, own = np.flatnonzero(which), np.arange(self.plant.n_local)
        steps = np.concatenate((self._steps(theta, len(local), which), self._steps_of_own(local)))  # [S, E]
        thetas = np.repeat(theta[None], 1 + len(steps), axis=0)
        locals_ = np.repeat(local[None], len(thetas), axis=0)
        thetas[1 + np.arange(len(which)), which] += steps[: len(which), 0]
        locals_[1 + len(which) + own, :, own] += steps[len(which) :]
        here, *_ = y = self.simulator.run_many(thetas, locals_, steps=False)  # [1 + S, E, T, ny]
        with np.errstate(invalid="ignore", over="ignore"):  # of simulations that grow without bound
            change = y[1:] - here
            change /= steps[:, :, None, None]
            change = self._where_measured(change)
            if self.records.soft:
                change *= softness(self.records.y - here, self.records.soft)
            slopes = self.noise.whiten(change).reshape(*steps.shape, here[0].size)
        if len(which) < len(theta):
            of_all = np.zeros((len(theta) + len(own), *slopes.shape[1:]))
            of_all[np.concatenate((which, len(theta) + own))] = slopes
            slopes = of_all
        return Jacobian(slopes, len(theta))

    def _steps(self, theta: np.ndarray, experiments: int, which: np.ndarray) -> Float[np.ndarray, "P E"]:
        """Choose the steps of some of theta, downwards at an upper bound."""
        steps = DIFFERENCE * self.sizes(theta)[which]
        steps[theta[which] + steps > self.plant.high[which]] *= -1
        return np.repeat(steps[:, None], experiments, axis=1)

    def _steps_of_own(self, local: np.ndarray) -> Float[np.ndarray, "q E"]:
        """Choose the steps of the numbers of each experiment: initial states, memories of terms, terms of its own."""
        plant, steps = self.plant, np.empty(local.T.shape)
        powers = [0 if plant.cascade else i % 2 if plant.joint else i for i in range(plant.order)]
        steps[: plant.order] = (DIFFERENCE * self._sizes[0] * plant.dt ** -np.array(powers, dtype=float))[:, None]
        # Towards the middle: on its other side a memory may be out of reach, and change nothing.
        memories = slice(plant.order, plant.n_start)
        steps[memories] = np.where(local[:, memories] > 0, -DIFFERENCE, DIFFERENCE).T
        for term in plant.per_experiment:
            size = self._sizes[term.channel] / self.records.duration
            if term.effect.port == "force":
                assert plant.scales is not None
                size = DIFFERENCE * plant.scales.of(term).force_rms
            steps[plant.own_part_of(term)] = size
        return steps

    def sizes(self, theta: np.ndarray) -> Float[np.ndarray, " p"]:
        """Return the size of each parameter, to which the step of its finite difference is proportional.

        One that is near zero has a share of what would be its size beside the others', in its own unit.
        """
        plant, layout, records = self.plant, self.plant.layout, self.records
        if plant.machine is not None:
            return self._with_terms(plant.machine.sizes(theta, records.duration, plant.order))
        poles = np.abs(theta[layout.poles])
        slowest, speed = 1 / records.duration, 1.0
        natural = np.empty(len(poles))
        if plant.joint:
            natural = two_masses.natural_sizes(poles, slowest)
            speed = natural[1]
        for first in range(0, 0 if plant.joint else len(poles), 1 if plant.cascade else 2):
            section = poles[first : first + (1 if plant.cascade else 2)]  # s + a, or s^2 + a1 s + a0
            rate = max(slowest, section[0], np.sqrt(section[-1]) if len(section) == 2 else 0.0)
            natural[first : first + len(section)] = [rate, rate * rate][: len(section)]
            speed *= rate ** len(section)
        sizes = np.abs(theta)
        sizes[layout.poles] = np.maximum(poles, SMALL * natural)
        inputs = np.repeat(records.input_sizes, len(plant.taps))
        drives = np.concatenate((sizes[layout.gains] * inputs, sizes[layout.offset]))
        drive = SMALL * max(np.max(drives), SMALL * speed * self._sizes[0])
        sizes[layout.gains] = np.maximum(sizes[layout.gains], drive / inputs)
        sizes[layout.offset] = np.maximum(sizes[layout.offset], drive)
        sizes[layout.zeros] = np.maximum(sizes[layout.zeros], SMALL * plant.dt ** np.arange(1.0, 1 + plant.zeros))
        sizes[layout.velocity] = np.maximum(sizes[layout.velocity], SMALL * self._sizes[-1] / self._sizes[0] * plant.dt)
        return self._with_terms(sizes)

    def _with_terms(self, sizes: Float[np.ndarray, " p"]) -> Float[np.ndarray, " p"]:
        """Give the parameters of terms that are near zero a share of where they usually start."""
        for at, usual in self._usual:
            sizes[at] = np.maximum(sizes[at], usual)
        return np.where(sizes > 0, sizes, SMALL)

    @cached_property
    def _usual(self) -> list[tuple[slice, Float[np.ndarray, " k"]]]:
        """Where the parameters of each term stand in theta, and a share of where they usually start."""
        plant, usual = self.plant, []
        for term in plant.terms:
            if term in plant.per_experiment:
                continue
            starts = [abs(np.array(start.values)) for start in plant.starts_of(term)]
            if starts:
                share = 0.1 * np.median(starts, axis=0)
                reach = np.array([p.high - p.low for p in plant.parameters_of(term)])
                usual.append((plant.part_of(term), np.where(share > 0, share, SMALL * reach)))
        return usual
