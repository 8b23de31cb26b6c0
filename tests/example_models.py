"""Models as a stranger writes them: nothing here imports simgap."""

import os
import signal
import sys
import threading
import time
import warnings
from dataclasses import dataclass
from pathlib import Path

import numba
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


class CarriedOn(Mean):
    """Carries on from a fit that was interrupted after a thousand seconds."""

    earlier_seconds = 1000.0


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


class Libraries(Mean):
    def fit(self, data, seed):
        import torch
        from threadpoolctl import threadpool_info

        super().fit(data, seed)
        blas = {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}
        self.fitted = {"torch": torch.get_num_threads(), "numba": numba.get_num_threads(), "blas": sorted(blas)}


class HangsInSimulate(Mean):
    def simulate(self, u, y_init):
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        while True:
            pass


class Crashes(Mean):
    def fit(self, data, seed):
        os.kill(os.getpid(), signal.SIGSEGV)


class Leaks(Mean):
    def fit(self, data, seed):
        kept = []
        while True:
            kept.append(np.ones(1 << 22))


class Prints(Mean):
    def fit(self, data, seed):
        super().fit(data, seed)
        for _ in range(2000):
            print("x" * 1000)
            os.write(2, b"y" * 1000)


class SinglePrecision(Mean):
    def simulate(self, u, y_init):
        return super().simulate(u, y_init).astype(np.float32)


class IsComplex(Mean):
    def simulate(self, u, y_init):
        return super().simulate(u, y_init) + 0j


class IsAList(Mean):
    def simulate(self, u, y_init):
        return super().simulate(u, y_init).tolist()


class Interrupts(Mean):
    def fit(self, data, seed):
        raise KeyboardInterrupt


class EndsInSimulate(Mean):
    def simulate(self, u, y_init):
        raise GeneratorExit


class Speechless(Exception):
    def __str__(self):
        raise ValueError("no words")


class RaisesSpeechless(Mean):
    def fit(self, data, seed):
        raise Speechless


class RaisesNovels(Mean):
    def fit(self, data, seed):
        raise ValueError("\ud800" + "word " * 100_000)


class LeavesAThread(Mean):
    def fit(self, data, seed):
        super().fit(data, seed)
        threading.Thread(target=time.sleep, args=(3600,)).start()


class ChoosesMuch(Mean):
    def fit(self, data, seed):
        super().fit(data, seed)
        self.fitted = {"all": list(range(1_000_000))}


class ChangesTheWorld(Mean):
    """What it does to its process must not reach the next model."""

    def fit(self, data, seed):
        super().fit(data, seed)
        np.concatenate = None


class Waits(Mean):
    """For a minute, and says which process it is."""

    def fit(self, data, seed):
        Path("pid.txt").write_text(str(os.getpid()))
        time.sleep(60)


class SeesGpu(Mean):
    def fit(self, data, seed):
        super().fit(data, seed)
        self.fitted = {"visible": os.environ.get("CUDA_VISIBLE_DEVICES")}


class Sleeps(Mean):
    def fit(self, data, seed):
        super().fit(data, seed)
        time.sleep(0.3)


class Compiles(Mean):
    def fit(self, data, seed):
        super().fit(data, seed)

        @numba.njit(parallel=True)
        def added(x):
            total = 0.0
            for i in numba.prange(len(x)):
                total += x[i]
            return total

        self.fitted = {"three": added(np.ones(3)), "threads": numba.get_num_threads()}


class NotAModel:
    pass
