"""Models as a stranger writes them: nothing here imports simgap."""

import os
import sys
import time
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np


class Mean:
    """The mean of the training data."""

    def fit(self, data, seed):
        self.mean = np.concatenate([experiment.y for experiment in data.train]).mean(axis=0)
        self.n_params = len(self.mean)
        self.fitted = {"mean": self.mean, "seed": np.int64(seed)}

    def simulate(self, u, y_init):
        return np.broadcast_to(self.mean, (len(u), u.shape[1] - y_init.shape[1], len(self.mean)))

    def summary(self):
        return "always the mean"


@dataclass
class Scaled(Mean):
    factor: float = 1.0

    def simulate(self, u, y_init):
        return self.factor * super().simulate(u, y_init)


class Warns(Mean):
    def fit(self, data, seed):
        super().fit(data, seed)
        warnings.warn("badly conditioned", RuntimeWarning, stacklevel=1)


class RaisesInFit(Mean):
    def fit(self, data, seed):
        raise RuntimeError("no luck\ntoday")


class RaisesInSimulate(Mean):
    def simulate(self, u, y_init):
        raise np.linalg.LinAlgError("singular")


class Leaves(Mean):
    def fit(self, data, seed):
        sys.exit(3)


class Dies(Mean):
    def fit(self, data, seed):
        os._exit(3)


class Hangs(Mean):
    def fit(self, data, seed):
        while True:
            pass


@dataclass
class Beats(Mean):
    """Hangs, and writes to a file as long as it lives."""

    file: str = "beats.txt"

    def fit(self, data, seed):
        while True:
            time.sleep(0.05)
            with Path(self.file).open("a") as file:
                file.write("x")


class IsNaN(Mean):
    def simulate(self, u, y_init):
        return super().simulate(u, y_init) * np.nan


class Explodes(Mean):
    def simulate(self, u, y_init):
        return super().simulate(u, y_init) * 1e150


class WrongShape(Mean):
    def simulate(self, u, y_init):
        return np.zeros_like(u)


class ChangesInput(Mean):
    def simulate(self, u, y_init):
        u += 1
        return super().simulate(u, y_init)


class ChangesTraining(Mean):
    def fit(self, data, seed):
        data.train[0].y[:] = 0


class Threads(Mean):
    def fit(self, data, seed):
        super().fit(data, seed)
        self.fitted = {name: os.environ.get(name) for name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS")}


class NotAModel:
    pass
