"""The simulation error of one output, with all experiments end to end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int

from simgap.records import Channel, Channels, Experiment


@dataclass(frozen=True, eq=False)
class Errors:
    """The error y - y_hat of one output: N samples of E experiments, each from n_init on, end to end."""

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
    sample: Int[np.ndarray, " N"] = field(init=False)  # counted from the start of its simulation

    def __post_init__(self) -> None:
        object.__setattr__(self, "experiment", np.repeat(np.arange(len(self.lengths)), self.lengths))
        object.__setattr__(self, "sample", np.concatenate([np.arange(n) for n in self.lengths]))

    def parts(self) -> list[Float[np.ndarray, " T"]]:
        """Split the error by experiment."""
        return np.split(self.error, np.cumsum(self.lengths)[:-1])


def errors(
    pairs: Sequence[tuple[Experiment, np.ndarray]], channels: Channels, output: int, n_init: int, seed: int
) -> Errors:
    """Collect the error of one output from pairs of an experiment and its simulation [T - n_init, ny]."""
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
