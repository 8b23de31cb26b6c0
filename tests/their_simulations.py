"""Simulations of the test rigs that share no code with simgap: scipy's integrator and the rig's equation.

python tests/their_simulations.py [CASES] [FIRST]    how often the first name is right
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import default_rng
from scipy.integrate import solve_ivp

from simgap.data.simulated.rigs import RIGS, hide, physical
from simgap.data.simulated.rigs.effects import CATALOGUE
from simgap.diagnosis.diagnose import diagnose
from simgap.records import Dataset, Experiment

# What an engineer's simulation may hold already: laws of one line.
SIMULATED = {
    "cart": ("dead_zone", "input_saturation", "quadratic_drag", "constant_load"),
    "stage": ("dead_zone", "input_saturation", "cubic_stiffness", "quadratic_drag"),
    "slide": ("dead_zone", "input_saturation", "cubic_stiffness", "quadratic_drag"),
    "tank": ("sqrt_outflow", "dead_zone"),
    "tanks": ("sqrt_outflow", "dead_zone"),
    "arm": ("dead_zone", "gravity"),
}
# What it may lack: effects that the recovery study finds by themselves.
LACKING = {
    "cart": ("dead_zone", "input_saturation", "coulomb_friction", "quadratic_drag", "backlash", "constant_load",
             "input_delay", "sensor_saturation"),
    "stage": ("dead_zone", "input_saturation", "coulomb_friction", "cubic_stiffness", "backlash", "hysteresis",
              "position_torque", "sensor_saturation"),
    "slide": ("dead_zone", "input_saturation", "coulomb_friction", "quadratic_drag", "cubic_stiffness", "backlash"),
    "tank": ("sqrt_outflow", "overflow", "dead_zone", "input_saturation"),
    "tanks": ("sqrt_outflow", "overflow", "input_saturation"),
    "arm": ("gravity", "coulomb_friction", "dead_zone"),
}  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A rig with effects; a simulation that lacks one of them, holds the others, and may have wrong linear numbers."""

    rig: str
    lacking: str
    holding: str
    wrong: float  # factor on gain and 1 / factor on damping or outflow
    seed: int
    true_start: bool

    def data(self) -> tuple[Dataset, Dataset]:
        """The measured rig, and the simulation of it."""
        held = {self.holding: 0.7} if self.holding else {}
        dataset = hide(self.rig, {self.lacking: 1.0} | held, noise=0.05, seed=self.seed)
        return dataset, simulation(dataset, self.rig, held, self.wrong, self.true_start)


def draw(number: int) -> Case:
    """Draw a case: a third lacks an effect only, a third has wrong numbers too, a third another effect besides."""
    rng = default_rng([7, number])
    rig = str(rng.choice(list(LACKING), p=[0.22, 0.26, 0.2, 0.12, 0.1, 0.1]))
    lacking = str(rng.choice(LACKING[rig]))
    holding = str(rng.choice([e for e in SIMULATED[rig] if e != lacking])) if number % 3 == 2 else ""
    wrong = float(rng.choice([0.75, 0.85, 1.15, 1.3])) if number % 3 == 1 else 1.0
    return Case(rig, lacking, holding, wrong, int(rng.integers(1_000_000)), rig == "arm" or bool(rng.random() < 0.5))


def simulation(
    dataset: Dataset, rig: str, effects: Mapping[str, float], wrong: float = 1.0, true_start: bool = True
) -> Dataset:
    """Simulate every experiment of a rig with scipy, from its true start or from rest at its first sample."""
    plant = RIGS[rig]
    size = {CATALOGUE[name].field: value for name, value in physical(rig, effects).items()}
    splits = (dataset.training.train, dataset.training.valid, dataset.test)
    experiments = [x for split in splits for x in split]
    seed = int(dataset.name.rsplit("_", 1)[1])
    places = [(i, number) for i, split in enumerate(splits) for number in range(len(split))]
    draws = [default_rng([list(RIGS).index(rig), seed, *place]).spawn(4)[1].standard_normal(2) for place in places]
    middle = np.array(plant.middle)
    starts = np.array([np.array(plant.start) * np.clip(d, -2, 2) + middle for d in draws])  # [E, 2]
    if not true_start:
        first = np.array([x.y[0, 0] for x in experiments])
        rest = np.full(len(first), middle[1] if plant.outflow else 0.0)
        starts = np.stack([rest, first] if plant.outputs[0].kind == "velocity" else [first, rest], axis=1)
    gain, rate = plant.gain * wrong, (plant.outflow or plant.damping) / wrong

    def arriving(u: np.ndarray) -> np.ndarray:
        zone, limit = size.get("dead_zone", 0.0), size.get("limit", np.inf)
        return np.clip(np.maximum(u - zone, 0.0) + np.minimum(u + zone, 0.0), -limit, limit)

    def leaving(level: np.ndarray, outflow: float, at: float) -> np.ndarray:
        share, level = size.get("root", 0.0), np.maximum(level, 0.0)
        return outflow * ((1 - share) * level + share * np.sqrt(level * at))

    def slope(_: float, z: np.ndarray, w: np.ndarray) -> np.ndarray:
        x, v = z.reshape(2, -1)
        if plant.outflow:
            out = leaving(x, rate, middle[0])
            if not plant.upper:
                return np.concatenate((gain * w - out, np.zeros_like(v)))
            passed = leaving(v, plant.upper, middle[1])
            return np.concatenate((passed - out, gain * w - passed))
        force = size.get("load", 0.0) - size.get("drag", 0.0) * v * np.abs(v)
        force = force - size.get("stiffness3", 0.0) * x**3 - size.get("gravity", 0.0) * np.sin(x)
        return np.concatenate((v, gain * w - rate * v - plant.stiffness * x + force))

    u = np.stack([x.u[:, 0] for x in experiments])  # [E, T]
    z, states = starts.T.reshape(-1), []
    for k in range(u.shape[1]):
        states.append(z)
        z = solve_ivp(slope, (0, plant.dt), z, args=(arriving(u[:, k]),), rtol=1e-7, atol=1e-9).y[:, -1]
    motion = np.stack(states).reshape(u.shape[1], 2, -1)  # [T, 2, E]
    columns = [{"position": 0, "velocity": 1, "level": 0}[output.kind] for output in plant.outputs]
    runs = [replace(x, y=motion[:, columns, i]) for i, x in enumerate(experiments)]

    def part(split: int) -> tuple[Experiment, ...]:
        return tuple(run for run, place in zip(runs, places, strict=True) if place[0] == split)

    training = replace(dataset.training, train=part(0), valid=part(1))
    return replace(dataset, training=training, test=part(2), sha256="")


def first_name_is_right(case: Case) -> tuple[bool, str]:
    """Diagnose the simulation of a case; a confounder that the answer itself names beside the first is right too."""
    dataset, simulated = case.data()
    answer = diagnose(dataset, simulated=simulated, views_too=False)
    listed = [(c.effect, c.holds, round(c.evidence, 3)) for c in answer.causes or answer.suspects]
    said = f"{answer.verdict} {listed}"
    if not answer.causes:
        return False, said
    first = answer.causes[0]
    return case.lacking in {first.effect, *(other.effect for other in first.confounded_with)}, said


def main(cases: int, first: int) -> None:
    """Print every case and the rate."""
    right = 0
    for number in range(first, first + cases):
        case = draw(number)
        good, said = first_name_is_right(case)
        right += good
        print(f"{right}/{number - first + 1} {'' if good else 'WRONG '}{case}: {said}", flush=True)


if __name__ == "__main__":
    main(*(int(argument) for argument in (sys.argv[1:] + ["60", "0"][len(sys.argv) - 1 :])))
