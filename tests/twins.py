"""Machines that move alike under some inputs: the rigs, what is hidden in either twin, and records of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from simgap.data.formats.plant_table import with_known
from simgap.data.simulated.rigs.inputs import KINDS, draw_input
from simgap.data.simulated.rigs.motion import simulate_motion
from simgap.data.simulated.rigs.plants import RIGS, Rig
from simgap.data.simulated.rigs.sensors import measure
from simgap.data.simulated.signals import in_splits, sines, steps
from simgap.records import Dataset, Experiment

Rng = np.random.Generator
SUBSTEPS, N_INIT = 20, 20
COUNTS = (2, 1, 2)  # records at hand: training, validation, test
STREAMS = {"inputs": 1, "at hand": 2, "random": 3, "new": 4}


@dataclass(frozen=True)
class Machine:
    """A rig with something hidden in it."""

    rig: Rig
    hidden: dict[str, float]

    def record(self, u: np.ndarray, noise: float, seed: tuple[int, ...]) -> Experiment:
        """Take a record under the input u [T]; the initial state and the noise are drawn from the seed."""
        start, other, of_noise, load = np.random.default_rng(seed).spawn(4)
        motion = simulate_motion(self.rig, self.hidden, u, (start, other, load), SUBSTEPS)
        y = measure(self.rig, self.hidden, motion, np.full(motion.shape[1], noise), 0.0, of_noise, SUBSTEPS)
        return Experiment("e" + "_".join(map(str, seed)), u[:, None], y, self.rig.dt)


@dataclass(frozen=True)
class Twins:
    """Two machines by the name of what sets them apart, the inputs at hand, the noise, and the limits of a record."""

    machines: dict[str, Machine]
    weak: Callable[[Rng, int], np.ndarray]  # input of one record at hand, of so many samples
    samples: int
    noise: float  # unit of the output
    largest: float  # input, either way
    travel: float  # output, either way
    known: dict[str, object] | None = None
    nominal: Machine | None = None  # what the user simulates

    def names(self, seed: int) -> tuple[str, str]:
        """Return the truth and its twin: by turns."""
        names = list(self.machines)
        return names[seed % 2], names[1 - seed % 2]

    def inputs_at_hand(self, machine: Machine, seed: int) -> list[np.ndarray]:
        """Draw those of the records at hand; only those to test on, which choose nothing, are as rigs draw them."""
        rng, *of_tests = np.random.default_rng((seed, STREAMS["inputs"])).spawn(1 + COUNTS[2])
        usual = [self.usual_input(machine, self.samples, None, of_test) for of_test in of_tests]
        return [self.weak(rng, self.samples) for _ in range(sum(COUNTS[:2]))] + usual

    def at_hand(self, machine: Machine, seed: int, noise: float | None = None, of: Machine | None = None) -> Dataset:
        """Take the records that leave the twins undecided; a simulation gets the inputs `of` the machine."""
        size = self.noise if noise is None else noise
        inputs = self.inputs_at_hand(of or machine, seed)
        records = [machine.record(u, size, (seed, STREAMS["at hand"], i)) for i, u in enumerate(inputs)]
        return with_known(in_splits(f"twins_{seed}", records, COUNTS, N_INIT, machine.rig.channels), self.known)

    def random_input(self, machine: Machine, designed: np.ndarray, seed: int) -> np.ndarray:
        """Draw an input as rigs do, as long as a designed one and of the same power, that stays within the travel."""
        power = float(np.mean(designed**2))
        return self.usual_input(machine, len(designed), power, np.random.default_rng((seed, STREAMS["random"])))

    def usual_input(self, machine: Machine, samples: int, power: float | None, rng: Rng) -> np.ndarray:
        """Draw inputs until the machine stays within its travel under one of them; less power only after 50 draws."""
        rig, size = replace(machine.rig, samples=samples), 1.0
        for draw in range(500):
            u = draw_input(rig, KINDS[rng.integers(len(KINDS))], rng)
            u *= size * (np.sqrt(power / np.mean(u**2)) if power else 1.0)
            y = simulate_motion(machine.rig, machine.hidden, u, np.random.default_rng(0).spawn(3), SUBSTEPS)[:, 0]
            if np.max(np.abs(y)) <= self.travel:
                return u
            size *= 0.9 if draw >= 50 else 1.0
        raise ValueError("no input stays within the travel")


def with_record(data: Dataset, x: Experiment) -> Dataset:
    """Put a record beside those to train on."""
    return replace(data, training=replace(data.training, train=(*data.training.train, x)), sha256="")


def slow(share: float, slower: int, longest: int, count: int) -> Callable[[Rng, int], np.ndarray]:
    """Draw sines so many times slower than `sines` does."""

    def draw(rng: Rng, samples: int) -> np.ndarray:
        return share * np.interp(np.arange(samples) / slower, np.arange(samples), sines(samples, longest, count, rng))

    return draw


CART = replace(RIGS["cart"], start=(0.0, 0.0))
BRISK = replace(CART, gain=3.2, damping=6.4)  # settles within two samples
ARM = replace(RIGS["arm"], start=(0.05, 0.1))
HANGS = 0.5 * 1.0 * 9.80665 / 1.0  # rad/s^2
# 0.5 kg at 1 m on a rotor of 0.5 kg m^2: what the user simulates, and what its twins have other.
NOMINAL = Machine(replace(ARM, start=(0.0, 0.0), gain=8.0, damping=3.0), {"gravity": HANGS})
PAIRS = {
    "delay or lag": Twins(
        {"input_delay": Machine(CART, {"delay": 0.1}), "actuator_lag": Machine(CART, {"lag": 0.1})},
        slow(4.0, 5, 20, 3), 120, 0.05, 4.0, 1.6,
    ),
    "spring or sine": Twins(
        {"cubic_stiffness": Machine(replace(ARM, stiffness=20.0), {"stiffness3": -20 / 6}),
         "gravity": Machine(ARM, {"gravity": 20.0})},
        lambda rng, n: 1.4 * steps(n, 15, 40, rng), 150, 0.02, 3.0, 2.2,
    ),
    "friction or dead zone": Twins(
        {"coulomb_friction": Machine(BRISK, {"coulomb": 2.4}), "dead_zone": Machine(BRISK, {"dead_zone": 0.75})},
        slow(3.0, 12, 24, 2), 250, 0.1, 4.0, 1.6,
    ),
    "motor or arm": Twins(
        {"gain": Machine(replace(NOMINAL.rig, gain=6.0), NOMINAL.hidden),
         "inertia": Machine(replace(NOMINAL.rig, gain=6.0, damping=2.25), {"gravity": 0.75 * HANGS})},
        slow(3.0, 1, 20, 3), 60, 0.05, 3.0, 1.5,
        {"mass": "0.5 kg", "arm": "1 m", "gravity": True}, NOMINAL,
    ),
}  # fmt: skip
