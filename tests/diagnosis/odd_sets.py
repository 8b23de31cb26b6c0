"""Data sets as nobody would wish them: drawn from a seed, for a diagnosis that must end in an answer or a sentence.

python tests/diagnosis/odd_sets.py FIRST COUNT          diagnose that many, one line each
"""

from __future__ import annotations

import json
import sys
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import lfilter

from simgap.records import Channel, Channels, Dataset, Experiment, TrainingSet, UnusableInput
from simgap.registry import EFFECTS

KINDS = ("position", "velocity", "level", "other")
LONGEST = 180.0  # s of CPU: a search that does not end
REFUSALS = (UnusableInput,)

# ------------------------------------------------------------------ signals


def steps(rng: np.random.Generator, n: int) -> np.ndarray:
    """Levels that hold for a while."""
    hold = int(rng.integers(1, max(2, n // 4)))
    return np.repeat(rng.uniform(-1, 1, -(-n // hold)), hold)[:n]


def ramp(rng: np.random.Generator, n: int) -> np.ndarray:
    """One straight line."""
    return np.linspace(*rng.uniform(-1, 1, 2), n)


def pulses(rng: np.random.Generator, n: int) -> np.ndarray:
    """Mostly zero."""
    return (rng.random(n) < rng.choice([0.005, 0.05])) * 1.0


def sine(rng: np.random.Generator, n: int) -> np.ndarray:
    """One frequency, so that little is excited."""
    return np.sin(2 * np.pi * rng.uniform(0.5, 1 + n / 4) * np.arange(n) / n + rng.uniform(0, 6))


def constant(rng: np.random.Generator, n: int) -> np.ndarray:
    """Nothing, or the same value throughout."""
    return np.full(n, rng.choice([0.0, 0.0, 1.0, -0.3]))


def mostly_constant(rng: np.random.Generator, n: int) -> np.ndarray:
    """A constant, with a short piece of noise."""
    u = np.full(n, rng.choice([0.0, 1.0]))
    at = int(rng.integers(0, n))
    u[at : at + max(1, n // 20)] += rng.standard_normal(len(u[at : at + max(1, n // 20)]))
    return u


def noise(rng: np.random.Generator, n: int) -> np.ndarray:
    """White noise."""
    return rng.standard_normal(n)


def walk(rng: np.random.Generator, n: int) -> np.ndarray:
    """A random walk."""
    return np.cumsum(rng.standard_normal(n))


def switch(rng: np.random.Generator, n: int) -> np.ndarray:
    """On and off."""
    return np.sign(steps(rng, n))


INPUTS = (steps, ramp, pulses, sine, constant, mostly_constant, noise, walk, switch)

# ------------------------------------------------------------------ plants: drive [n] -> output [n]


def filtered(b: list[float], a: list[float]) -> Callable[[np.ndarray], np.ndarray]:
    """A linear filter whose output stays a measurement."""

    def respond(drive: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):
            return np.clip(np.nan_to_num(lfilter(b, a, drive), posinf=1e9, neginf=-1e9), -1e9, 1e9)

    return respond


def plant(rng: np.random.Generator) -> tuple[str, Callable[[np.ndarray], np.ndarray]]:
    """Draw a plant, and say which."""
    pole, delay = rng.uniform(0.5, 0.995), int(rng.integers(1, 30))
    w, r = rng.uniform(0.02, 2.5), rng.uniform(0.8, 0.999)
    choices = {
        "lag": filtered([0.0, 1 - pole], [1.0, -pole]),
        "resonance": filtered([0.0, 0.1], [1.0, -2 * r * np.cos(w), r * r]),
        "static": lambda drive: 2.5 * drive,
        "delay": lambda drive: np.concatenate((np.zeros(delay), drive))[: len(drive)],
        "unstable": filtered([0.0, 0.1], [1.0, -rng.uniform(1.0005, 1.2)]),
        "integrator": filtered([0.0, 0.05], [1.0, -1.0]),
        "double integrator": filtered([0.0, 0.01], [1.0, -2.0, 1.0]),
        "walk": lambda drive: np.cumsum(rng.standard_normal(len(drive))),
        "noise": lambda drive: rng.standard_normal(len(drive)),
        "still": np.zeros_like,
        "clipped lag": lambda drive: np.clip(lfilter([0.0, 1 - pole], [1.0, -pole], drive), -0.1, 0.2),
        "differentiator": lambda drive: np.diff(drive, prepend=drive[0]),
        "negative": lambda drive: -np.abs(lfilter([0.0, 1 - pole], [1.0, -pole], drive)),
    }
    name = str(rng.choice(list(choices)))
    return name, choices[name]


# ------------------------------------------------------------------ data sets


def spoiled(rng: np.random.Generator, y: np.ndarray) -> np.ndarray:
    """Glitches, a few levels only, or nothing of the kind."""
    ill = rng.choice(["", "", "", "glitches", "levels", "stuck"])
    if ill == "glitches":
        bad = rng.random(len(y)) < rng.choice([0.002, 0.03, 0.3])
        return np.where(bad, y + rng.choice([1e3, -30.0]) * (np.ptp(y) or 1.0), y)
    if ill == "levels" and np.ptp(y) > 0:
        step = np.ptp(y) / rng.integers(1, 3)
        return step * np.round(y / step)
    if ill == "stuck":
        return np.where(np.arange(len(y)) > rng.uniform(0, len(y)), y[len(y) // 2], y)
    return y


def draw(seed: int) -> tuple[Dataset, str]:
    """Draw a data set, and say what it is. Raises UnusableInput as any data set does."""
    rng = np.random.default_rng(seed)
    nu, ny = int(rng.choice([1, 1, 2])), int(rng.choice([1, 1, 2]))
    kinds = [str(rng.choice(KINDS)) for _ in range(ny)]
    count = int(rng.choice([1, 1, 2, 3, 5, 10, 20]))
    total = np.exp(rng.uniform(np.log(40), np.log(5000)))
    dt = float(10.0 ** rng.uniform(-6, 3)) if rng.random() < 0.3 else float(rng.choice([0.01, 0.1, 1.0]))
    u_scale, y_scale = (10.0 ** rng.uniform(-12, 12) if rng.random() < 0.4 else 1.0 for _ in range(2))
    u_offset, y_offset = (rng.choice([0.0, 0.0, 0.0, 1.0, -30.0, 1e6]) for _ in range(2))
    spread = float(rng.choice([0.0, 0.0, 1e-6, 0.01, 0.1, 1.0]))
    wild = np.random.default_rng([seed, 1])
    if wild.random() < 0.05:  # units of no machine
        u_scale, y_scale, dt = (
            10.0 ** wild.uniform(-90, 90),
            10.0 ** wild.uniform(-90, 90),
            10.0 ** wild.uniform(-20, 20),
        )
    inputs = [INPUTS[rng.integers(len(INPUTS))] for _ in range(nu)]
    plants = [plant(rng) for _ in range(ny)]
    still = int(rng.integers(0, count)) if rng.random() < 0.15 else -1

    def experiment(i: int) -> Experiment:
        n = max(1, int(total / count * rng.choice([0.02, 0.3, 1.0, 1.0, 1.0, 2.0]))) if count > 1 else int(total)
        u = np.stack([signal(rng, n) for signal in inputs], axis=1)
        drive = u @ rng.choice([1.0, -0.5, 0.0], nu, p=[0.7, 0.2, 0.1])
        columns = []
        for _, respond in plants:
            y = np.zeros(n) if i == still else respond(drive)
            y = y + spread * (np.std(y) or 1.0) * rng.standard_normal(n)
            columns.append(spoiled(rng, y))
        y = np.stack(columns, axis=1) + y_offset
        return Experiment(f"e{i}", u_scale * (u + u_offset), y_scale * y, dt)

    made = [experiment(i) for i in range(count)]
    n_init = int(rng.choice([1, 2, 5, 10, 20, 50]))
    if count < 3:
        # One record is cut in three, as a user would.
        whole = made[0]
        a, b = int(0.6 * len(whole)), int(0.8 * len(whole))
        train, valid, test = [whole[:a], *made[1:]], [whole[a:b]], [whole[b:]]
    else:
        train, valid, test = made[:-2], made[-2:-1], made[-1:]
    if rng.random() < 0.25:
        valid = []
    if rng.random() < 0.9:  # mostly, the test records leave something to score
        n_init = max(1, min(n_init, min(map(len, test)) // 3))
    if wild.random() < 0.02:
        train.append(train[0][:0])
    channels = Channels(
        tuple(Channel(f"u{i}", "V") for i in range(nu)),
        tuple(Channel(f"y{i}", str(rng.choice(["", "m", "m/s"])), kind) for i, kind in enumerate(kinds)),
    )
    what = (
        f"{'+'.join(name for name, _ in plants)} {'+'.join(kinds)} of {'+'.join(f.__name__ for f in inputs)}, "
        f"{count} experiments, {sum(map(len, made))} samples, dt {dt:.2g}, n_init {n_init}, u x {u_scale:.1g} "
        f"+ {u_offset:g}, y x {y_scale:.1g} + {y_offset:g}, noise {spread:g}{', no validation' * (not valid)}"
    )
    training = TrainingSet(tuple(train), tuple(valid), n_init, channels)
    return Dataset(f"odd-{seed}", training, tuple(test), n_init, channels), what


# ------------------------------------------------------------------ what must hold


def outcome(seed: int) -> str:
    """Diagnose an odd set, and fit chosen effects to every sixth as well: the verdict, or the sentence of a refusal.

    Raises what a user would see as a traceback, a warning as an error, and ValueError where the answer is no JSON.
    """
    from simgap.baselines.greybox import GreyBox
    from simgap.diagnosis.diagnose import diagnose

    begin = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message="First-class function type feature is experimental")
        try:
            dataset, _ = draw(seed)
            answer = diagnose(dataset, profiles=seed % 6 == 1)
            json.dumps(answer.to_json(), allow_nan=False)
            said = answer.verdict
            if seed % 6 == 0:
                rng = np.random.default_rng(seed)
                effects = [str(name) for name in rng.choice(EFFECTS.names(), 2, replace=False)]
                model = GreyBox(effects=effects)
                model.fit(dataset.training, seed)
                for x in dataset.test:
                    model.simulate(x.u[None], x.y[None, : dataset.n_init])
        except REFUSALS as refusal:
            said = f"refused: {refusal}"
    seconds = time.process_time() - begin
    if seconds > LONGEST:
        raise AssertionError(f"took {seconds:.0f} s")
    return said


def main() -> None:
    """Write one line for each set: seed, seconds, outcome; a traceback where there is one."""
    first, count = map(int, sys.argv[1:3])
    for seed in range(first, first + count):
        begin = time.process_time()
        try:
            said: Any = outcome(seed)
        except Exception as error:
            frames = traceback.extract_tb(error.__traceback__)[-4:]
            at = " ".join(f"{Path(frame.filename).name}:{frame.lineno}" for frame in frames)
            said = f"FAILED {type(error).__name__}: {error} at {at}".replace("\n", " ")
        print(f"{seed}\t{time.process_time() - begin:.1f}\t{said}", flush=True)


if __name__ == "__main__":
    main()
