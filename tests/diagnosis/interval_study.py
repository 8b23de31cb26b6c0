"""How often the interval of the gain names nothing, and finds something, where errors remember each other.

Two predictors whose errors are equally large, or one of them by a known share smaller: autoregressive, independent of
each other, with memories of 1 to 50 samples. Seeded.

python tests/diagnosis/interval_study.py [REPETITIONS]          the table
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np
from scipy.signal import lfilter

from simgap.error_views.correlation import correlation_time
from simgap.error_views.gain_interval import share_with_interval

EXPERIMENTS = (1, 2, 3, 4, 15)
SAMPLES = (100, 300, 1000)
MEMORIES = (1, 10, 50)
GAINS = (0.0, 0.1, 0.3)


def errors(rng: np.random.Generator, experiments: int, samples: int, memory: int) -> np.ndarray:
    """Draw errors [E, T] of variance 1 whose autocorrelation is exp(-lag / memory), settled."""
    pole = np.exp(-1 / memory)
    w = rng.standard_normal((experiments, samples + 8 * memory))
    return lfilter([np.sqrt(1 - pole**2)], [1.0, -pole], w, axis=1)[:, 8 * memory :]


def found(
    experiments: int, samples: int, memory: int, repetitions: int, gains: tuple[float, ...] = GAINS
) -> list[float]:
    """Compute for each true gain how often the interval lies above zero, from the same draws."""
    rng = np.random.default_rng((experiments, samples, memory))
    lengths = np.full(experiments, samples)
    above = np.zeros(len(GAINS))
    for _ in range(repetitions):
        both = [errors(rng, experiments, samples, memory).ravel() for _ in range(2)]
        known = max(correlation_time(e, lengths, 0)[0] for e in both)
        before, after = (e**2 for e in both)
        above += [share_with_interval(before, after * (1 - gain) ** 2, lengths, known)[1] > 0 for gain in GAINS]
    return list(above / repetitions)


def study(repetitions: int) -> Iterator[tuple[int, int, int, list[float]]]:
    """Go through all memories, lengths and numbers of experiments."""
    for memory in MEMORIES:
        for samples in SAMPLES:
            for experiments in EXPERIMENTS:
                yield memory, samples, experiments, found(experiments, samples, memory, repetitions)


def main() -> None:
    """Print for each number of experiments how many percent lie above zero with a gain of 0, 10 and 30 %."""
    repetitions = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    print("memory  samples  " + "".join(f"{f'{e} exp.':>18s}" for e in EXPERIMENTS))
    for memory, samples, experiments, shares in study(repetitions):
        if experiments == EXPERIMENTS[0]:
            print(f"{memory:6d}  {samples:7d}  ", end="")
        cell = " / ".join(f"{100 * share:.1f}" if i == 0 else f"{100 * share:.0f}" for i, share in enumerate(shares))
        print(f"{cell:>18s}", end="\n" if experiments == EXPERIMENTS[-1] else "", flush=True)


if __name__ == "__main__":
    main()
