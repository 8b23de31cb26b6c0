"""`hide`: recordings of a machine in the field with effects hidden in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.random import Generator, default_rng

from simgap.data.simulated.field.inputs import draw_wanted, slow_disturbance
from simgap.data.simulated.field.kernels import Actuator, Machine, run
from simgap.data.simulated.field.machines import RIGS, Plant
from simgap.data.simulated.field.sizes import apply, largest_angle, suitable
from simgap.data.simulated.signals import coloured_noise, in_splits
from simgap.records import Dataset, Experiment

COUNTS = (8, 4, 4)  # experiments to train, validate and test on
SAMPLES = 300
N_INIT = 20
SUBSTEPS = 20  # of the integration, per sample
CALIBRATIONS = 12  # runs that find how hard to push a pendulum
APART = 1000  # from the seeds of the other rigs


def hide(
    rig: str,
    effects: Mapping[str, float],
    noise: float = 0.02,
    colour: float = 0.0,
    seed: int = 0,
    substeps: int = SUBSTEPS,
) -> Dataset:
    """Record a machine with effects of the given strengths (1 strong, 0.5 medium, 0.25 weak) hidden in it.

    `noise` is the standard deviation of the added noise as a share of that of the true motion, `colour` its
    AR(1) coefficient. The machine's constants, set points or inputs and noise draws depend on rig and seed alone;
    where a controller closes the loop, its output also answers what is hidden. Raises ValueError for an effect that
    does not suit the machine.
    """
    known = (*suitable(rig), *suitable(rig, outside=True))
    if unknown := sorted(set(effects) - set(known)):
        raise ValueError(f"{', '.join(unknown)} cannot be hidden in {rig!r}; what can be: {', '.join(known)}")
    rng = default_rng([APART + list(RIGS).index(rig), seed])
    plant = RIGS[rig].draw(rng)
    channel, jump = int(rng.integers(len(plant.scale))), float(rng.uniform(0.3, 0.9))
    bench = _Bench(plant, rng, colour, substeps)
    if plant.machine.gravity:
        bench.push_to(largest_angle(effects.get("gravity", 0.0)))
    u, y = bench.record(plant.machine, Actuator(), 0.0, 0.0)
    spread = noise * float(np.std(y))
    hidden = {name: strength for name, strength in effects.items() if name != "gravity"}
    u, y = bench.record(*apply(plant, hidden, u[..., channel], y, channel, jump), spread)
    y = y + spread * bench.noise
    records = [Experiment(f"e{i:02d}", u[i], y[i][:, None], plant.dt) for i in range(len(u))]
    return in_splits(f"{rig}_{seed}", records, COUNTS, N_INIT, plant.channels)


@dataclass(eq=False)
class _Bench:
    """A machine with all that is drawn for its experiments."""

    plant: Plant
    rng: Generator
    colour: float
    substeps: int

    def __post_init__(self) -> None:
        streams = [stream.spawn(3) for stream in self.rng.spawn(sum(COUNTS))]
        self.wanted = np.stack([draw_wanted(self.plant, i, SAMPLES, s[0]) for i, s in enumerate(streams)])
        self.noise = np.stack([coloured_noise(SAMPLES, self.colour, s[1]) for s in streams])
        self.slow = np.stack([slow_disturbance(SAMPLES + 1, s[2]) for s in streams])

    @cached_property
    def start(self) -> tuple[float, float, float, float]:
        """The states at the operating point."""
        plant = self.plant
        flow = sum(g * u for g, u in zip((plant.machine.gain, plant.machine.gain2), plant.middle, strict=False))
        level = plant.middle[0] if plant.controller.closed else flow
        return (level, 0.0, level, 0.0) if plant.machine.process else (0.0, 0.0, 0.0, 0.0)

    def record(self, machine: Machine, actuator: Actuator, drift: float, noise: float) -> tuple[np.ndarray, np.ndarray]:
        """Run all experiments: inputs [E, T, nu] and true outputs [E, T]."""
        runs = [
            run(machine, self.plant.controller, actuator, wanted, noise * e, drift * d, self.start, self.plant.dt,
                self.substeps)
            for wanted, e, d in zip(self.wanted, self.noise, self.slow, strict=True)
        ]  # fmt: skip
        return np.stack([u for u, _ in runs]), np.stack([y for _, y in runs])

    def push_to(self, angle: float) -> None:
        """Scale the inputs until the largest angles, those of one sample in twenty, are as asked."""
        low, high, wanted = 0.0, 4.0, self.wanted
        for _ in range(CALIBRATIONS):
            share = (low + high) / 2
            self.wanted = share * wanted
            _, y = self.record(self.plant.machine, Actuator(), 0.0, 0.0)
            low, high = (low, share) if np.quantile(np.abs(y), 0.95) > angle else (share, high)
