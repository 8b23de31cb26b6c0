"""`hide`: recordings of a rig with effects hidden in it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.random import default_rng

from simgap.data.simulated.rigs.effects import CATALOGUE, OUTSIDE, physical
from simgap.data.simulated.rigs.inputs import KINDS, draw_input
from simgap.data.simulated.rigs.motion import simulate_motion
from simgap.data.simulated.rigs.plants import RIGS
from simgap.data.simulated.rigs.sensors import measure
from simgap.data.simulated.signals import in_splits
from simgap.records import Dataset, Experiment

N_INIT = 20
SUBSTEPS = 20  # of the integration, per sample


def hide(
    rig: str,
    effects: Mapping[str, float],
    noise: float = 0.05,
    colour: float = 0.0,
    seed: int = 0,
    substeps: int = SUBSTEPS,
) -> Dataset:
    """Record a rig with effects of the given strengths (1 strong, 0.5 medium, 0.25 weak) hidden in it.

    `noise` is the standard deviation of the added noise as a share of that of the true motion, `colour` its
    AR(1) coefficient from sample to sample. The sensors' effects hit the first output only. Inputs, initial
    states and noise draws depend on rig and seed alone.
    """
    size = {(CATALOGUE | OUTSIDE)[name].field: value for name, value in physical(rig, effects).items()}
    plant = RIGS[rig]
    counts = (plant.n_train, plant.n_valid, plant.n_test)
    # The seed of an experiment is its place in its split, so that no split depends on the size of another.
    places = [(split, number) for split, count in enumerate(counts) for number in range(count)]
    streams = [default_rng([list(RIGS).index(rig), seed, *place]).spawn(5) for place in places]
    inputs = [draw_input(plant, KINDS[place[1] % len(KINDS)], s[0]) for place, s in zip(places, streams, strict=True)]
    motions = [
        simulate_motion(plant, size, u, (s[1], s[2], s[4]), substeps) for u, s in zip(inputs, streams, strict=True)
    ]
    spread = np.std(np.concatenate([motion[::substeps] for motion in motions]), axis=0)  # [ny]
    records = []
    for number, (u, motion, stream) in enumerate(zip(inputs, motions, streams, strict=True)):
        y = measure(plant, size, motion, noise * spread, colour, stream[3], substeps)
        records.append(Experiment(f"e{number:02d}", u[:, None], y, plant.dt))
    return in_splits(f"{rig}_{seed}", records, counts, N_INIT, plant.channels)
