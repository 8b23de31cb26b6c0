"""The records of the views: the error of one output over all experiments, and one view of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int

from simgap.records import Channel, Channels, Experiment


@dataclass(frozen=True)
class View:
    """One view of the error y - y_hat of one output.

    `share` is the part of the mean squared error that the mean errors of the view's bins (or its strongest band)
    explain beyond chance; `chance` is how often chance alone explains as much (p-value, for this view by itself).
    `text` says it in a sentence. For plots: `at` holds the bins' centres, in `unit`, and `error` the mean errors
    there (the RMS errors for bands and sizes), in the unit of the output. For "experiment" and its relatives `at`
    counts experiments (or their kinds) from 1, and the halves of experiment i are at i - 0.25 and i + 0.25. The offset
    is at 0; directions are -1 (back), 0 (rest) and 1 (forwards).
    """

    view: str
    output: str
    share: float
    chance: float
    text: str
    at: tuple[float, ...]
    error: tuple[float, ...]
    unit: str


@dataclass(frozen=True, eq=False)
class Errors:
    """What the simulation of one output gets wrong: N samples of E experiments, end to end, from n_init on."""

    channel: Channel
    error: Float[np.ndarray, " N"]  # y - y_hat
    y_hat: Float[np.ndarray, "N ny"]  # all outputs, as simulated
    u: Float[np.ndarray, "N nu"]
    lengths: tuple[int, ...]  # [E]
    names: tuple[str, ...]  # [E]
    dt: float
    channels: Channels
    seed: int
    experiment: Int[np.ndarray, " N"] = field(init=False)
    sample: Int[np.ndarray, " N"] = field(init=False)  # since the start of the simulation

    def __post_init__(self) -> None:
        object.__setattr__(self, "experiment", np.repeat(np.arange(len(self.lengths)), self.lengths))
        object.__setattr__(self, "sample", np.concatenate([np.arange(n) for n in self.lengths]))

    def parts(self) -> list[Float[np.ndarray, " T"]]:
        """The error of each experiment."""
        return np.split(self.error, np.cumsum(self.lengths)[:-1])


def errors(
    pairs: Sequence[tuple[Experiment, np.ndarray]], channels: Channels, output: int, n_init: int, seed: int
) -> Errors:
    """The error of one output over experiments and their simulations [T - n_init, ny]."""
    y_hat = np.concatenate([simulated for _, simulated in pairs])
    y, u = (np.concatenate([getattr(x, column)[n_init:] for x, _ in pairs]) for column in ("y", "u"))
    return Errors(
        channels.outputs[output],
        y[:, output] - y_hat[:, output],
        y_hat,
        u,
        tuple(len(simulated) for _, simulated in pairs),
        tuple(x.name for x, _ in pairs),
        pairs[0][0].dt,
        channels,
        seed,
    )
