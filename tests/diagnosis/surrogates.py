"""How often something is named on surrogates: a linear model of a measured machine, and its own errors shuffled.

What the linear model cannot explain is still there, as large and as coloured as it was measured, but no longer where
the input or the motion put it: there is nothing to name. Seeded.

python tests/diagnosis/surrogates.py COUNT FOLDER [FOLDER ..]          so many surrogates of each data set
"""

from __future__ import annotations

import math
import sys
import time
import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from simgap.data import load
from simgap.diagnosis.diagnose import diagnose
from simgap.diagnosis.gains import free_run
from simgap.error_views.correlation import correlation_time
from simgap.records import Dataset
from simgap.registry import MODELS

BLOCK = 4  # times over which the errors remember themselves


def surrogate(dataset: Dataset, seed: int) -> Dataset:
    """Put the errors of the plain model back at other times, in blocks that keep their colour (Kunsch 1989)."""
    rng, n = np.random.default_rng(seed), dataset.n_init
    model = MODELS["greybox"](effects=())
    model.fit(dataset.training, 0)
    experiments = (*dataset.training.train, *dataset.training.valid, *dataset.test)
    simulated = [free_run(model, x, n) for x in experiments]
    errors = [x.y[n:] - y_hat for x, y_hat in zip(experiments, simulated, strict=True)]
    length = block_length(errors)
    made = []
    for x, y_hat in zip(experiments, simulated, strict=True):
        y = x.y.copy()
        y[n:] = y_hat + shuffled(errors, len(y_hat), length, rng)
        made.append(replace(x, y=y))
    train, valid = len(dataset.training.train), len(dataset.training.valid)
    training = replace(dataset.training, train=tuple(made[:train]), valid=tuple(made[train : train + valid]))
    return replace(dataset, training=training, test=tuple(made[train + valid :]))


def block_length(errors: Sequence[np.ndarray]) -> int:
    """Take blocks that are long beside the memory of the errors and beside what happens at once in them, but short
    beside the records: at least the root of their length, at most a quarter of it.
    """
    lengths = np.array([len(error) for error in errors])
    means = np.concatenate([error - error.mean(axis=0) for error in errors])
    tau = max(correlation_time(means[:, j], lengths, len(lengths))[0] for j in range(means.shape[1]))
    return int(np.clip(BLOCK * tau, math.isqrt(lengths.max()), max(2, lengths.max() // 4)))


def shuffled(errors: Sequence[np.ndarray], samples: int, length: int, rng: np.random.Generator) -> np.ndarray:
    """Draw blocks of the errors of all experiments until there are so many samples."""
    pool = np.concatenate(errors)
    starts = rng.integers(0, max(1, len(pool) - length), -(-samples // length))
    return np.concatenate([pool[start : start + length] for start in starts])[:samples]


def main() -> None:
    """Write one line for each surrogate that is called anything but nothing, and the counts."""
    count, folders = int(sys.argv[1]), sys.argv[2:]
    warnings.simplefilter("ignore")
    total: Counter[str] = Counter()
    for folder in folders:
        dataset, begin, said = load(folder), time.perf_counter(), Counter[str]()
        for seed in range(count):
            answer = diagnose(surrogate(dataset, seed), views_too=False)
            said[answer.verdict] += 1
            if answer.verdict != "nothing_found":
                names = [cause.effect for cause in (*answer.causes, *answer.suspects)]
                print(f"  {Path(folder).name}, seed {seed}: {answer.verdict} {', '.join(names)}", flush=True)
        total += said
        print(f"{Path(folder).name}: {dict(said)}, {(time.perf_counter() - begin) / count:.1f} s each", flush=True)
    print(dict(total))


if __name__ == "__main__":
    main()
