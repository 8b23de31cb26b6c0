"""What is said of random linear plants: nothing is to be named, and the plain model should leave only the noise.

One to four poles over two decades, swinging or not, side by side with weights of either sign, so that zeros lie
anywhere; steps of random heights and lengths. Seeded.

python tests/diagnosis/linear_plants.py FIRST LAST KIND     the plants of these seeds, said to be of that kind
"""

from __future__ import annotations

import sys
import time

import numpy as np
from scipy.linalg import block_diag
from scipy.signal import cont2discrete

from simgap.diagnosis.diagnose import diagnose
from simgap.records import Channel, Channels, Dataset, Experiment, Kind, TrainingSet

DT = 0.1  # s
NOISE = 0.02  # of the output's spread


def linear_plant(rng: np.random.Generator, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A, B and C of modes whose rates lie between what a record and what its sampling shows."""
    blocks, b, c, order = [], [], [], int(rng.integers(1, 5))
    while len(b) < order:
        rate = np.exp(rng.uniform(np.log(3 / (samples * DT)), np.log(0.4 / DT)))
        weight = rng.uniform(0.3, 1.0) * rng.choice([1.0, 1.0, 1.0, -1.0])
        if order - len(b) >= 2 and rng.random() < 0.5:
            blocks.append(np.array([[0.0, 1.0], [-(rate**2), -2 * rng.uniform(0.05, 0.9) * rate]]))
            b, c = [*b, 0.0, weight * rate**2], [*c, 1.0, 0.0]
        else:
            blocks.append(np.array([[-rate]]))
            b, c = [*b, weight * rate], [*c, 1.0]
    return block_diag(*blocks), np.array(b)[:, None], np.array(c)[None]


def steps(rng: np.random.Generator, samples: int, hold: float) -> np.ndarray:
    """Steps of random heights, each held for `hold` samples in the mean."""
    lengths = rng.geometric(1 / hold, samples)
    return np.repeat(rng.uniform(-1, 1, samples), lengths)[:samples]


def data_set(seed: int, kind: Kind = "other") -> Dataset:
    """Two records to train with, one to validate and one to test."""
    rng = np.random.default_rng(seed)
    samples = int(rng.choice([400, 800, 1500]))
    a, b, c = linear_plant(rng, samples)
    a, b, *_ = cont2discrete((a, b, c, np.zeros((1, 1))), DT)
    hold = float(np.exp(rng.uniform(np.log(3), np.log(samples / 8))))
    u, y = np.stack([steps(rng, samples, hold) for _ in range(4)]), np.empty((4, samples))
    for inputs, readings in zip(u, y, strict=True):
        x = np.zeros(len(a))
        for k in range(samples):
            readings[k] = c[0] @ x
            x = a @ x + b[:, 0] * inputs[k]
    y += NOISE * y.std() * rng.standard_normal(y.shape)
    made = tuple(Experiment(f"e{i}", u[i, :, None], y[i, :, None], DT) for i in range(4))
    channels = Channels((Channel("u"),), (Channel("y", kind=kind, kind_from="written"),))
    training = TrainingSet(made[:2], made[2:3], 10, channels)
    return Dataset(f"linear-{seed}", training, made[3:], 10, channels)


def main() -> None:
    """Print what is said of each plant."""
    first, last, *kind = sys.argv[1:]
    for seed in range(int(first), int(last)):
        begun = time.perf_counter()
        found = diagnose(data_set(seed, *kind)).findings
        named, suspected = ([cause.effect for cause in causes] for causes in (found.causes, found.suspects))
        fit = found.baseline["fit_percent"]["y"]
        print(seed, found.verdict, named, suspected, f"fit {fit:.1f} % {time.perf_counter() - begun:.1f} s", flush=True)


if __name__ == "__main__":
    main()
