"""The true motion of a rig with hidden effects, integrated at a fine step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf

import numpy as np
from jaxtyping import Float
from numpy.random import Generator

from simgap.data.simulated.rigs.drive_kernels import Drive
from simgap.data.simulated.rigs.kernels import Body, Tanks, fill, move
from simgap.data.simulated.rigs.plants import Rig

SLIP = 0.6  # of a sticking valve: the jump as a share of the band
FOLD_LOST = 0.6  # of a torque that folds back: the share that is lost at twice the error where it begins
INNER_LAG = 5.0  # samples, of the lag before a limit


def simulate_motion(
    rig: Rig, size: Mapping[str, float], u: np.ndarray, rngs: Sequence[Generator], substeps: int
) -> Float[np.ndarray, "n ny"]:
    """Integrate the true outputs [T substeps, ny] under the input u [T].

    What is drawn: the initial state, the input that is missing, and the slope of the load, each from its own generator.
    """
    start_rng, missing_rng, load_rng = rngs
    other = size.get("missing", 0.0) * _band(len(u) + 1, missing_rng)  # [T + 1]
    other += size.get("load_slope", 0.0) * load_rng.standard_normal() * rig.dt * np.arange(len(other))
    known = {"amplitude": rig.largest_input, "limit": size.get("limit", inf), "rate": size.get("rate", inf)}
    if "inner_limit" in size:  # and a lag before it
        known["lag"] = INNER_LAG * rig.dt if size["inner_limit"] < inf else 0.0
    known |= {"inner_limit": size.get("inner_limit", inf), "slip": SLIP * size.get("stick", 0.0)}
    drive = Drive(**{field: known.get(field, size.get(field, 0.0)) for field in Drive._fields})
    offset, middle = rig.start * np.clip(start_rng.standard_normal(2), -2, 2), rig.middle
    first, second = (float(value) for value in offset + middle)
    if rig.outflow:
        known = {"gain": rig.gain, "outflow": rig.outflow, "upper": rig.upper, "rim": size.get("rim", inf)}
        known |= {"level": middle[0], "upper_level": middle[1], "spill": 0.5, "frequency": rig.frequency, "phase": 0.7}
        tanks = Tanks(**{field: known.get(field, size.get(field, 0.0)) for field in Tanks._fields})
        return fill(tanks, drive, u, other, first, second, rig.dt, substeps)[:, :1].copy()
    known = {field: getattr(rig, field) for field in Body._fields if hasattr(rig, field)}
    known |= {"position_period": rig.period, "position_phase": 1.0, "phase": 0.7, "stop": size.get("stop", inf)}
    known |= {"coast": size.get("coast", inf)}
    known |= {"fold": size.get("fold", inf), "fold_lost": FOLD_LOST}
    body = Body(**{field: known.get(field, size.get(field, 0.0)) for field in Body._fields})
    motion = move(body, drive, u, other, first, second, rig.dt, substeps)
    return motion[:, [{"velocity": 1}.get(output.kind, 0) for output in rig.outputs]]


def _band(samples: int, rng: Generator) -> Float[np.ndarray, " n"]:
    """Draw band-limited noise of standard deviation about 1: twenty sines with periods of 10 to 100 samples."""
    frequencies, phases = rng.uniform(1 / 100, 1 / 10, 20), rng.random(20)
    return np.sin(2 * np.pi * (np.arange(samples)[:, None] * frequencies + phases)).sum(axis=1) / np.sqrt(10)
