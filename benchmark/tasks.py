"""What a fitted model is asked to do with a test experiment. Every task goes through `model.simulate`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float, Int

from simgap.metrics import is_finite, score, score_outputs
from simgap.records import Channels, Experiment, UnusableInput

Simulate = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A fitted model before one test experiment; n_init measured outputs may start a simulation.

    `simulate(u [B, T, nu], y_init [B, n_init, ny])` returns y_hat [B, T-n_init, ny].
    """

    simulate: Simulate
    experiment: Experiment
    n_init: int
    channels: Channels

    @cached_property
    def free_run(self) -> Float[np.ndarray, "N ny"]:
        """Rows n_init .. T-1 of the experiment, simulated in one go. Computed once for all tasks."""
        return self.simulate(self.experiment.u[None], self.experiment.y[None, : self.n_init])[0]


@dataclass(frozen=True)
class Outcome:
    """Figures per output, and whether every simulated value was finite."""

    metrics: dict[str, dict[str, Any]]
    finite: bool


@dataclass(frozen=True)
class Task(ABC):
    """One way to score a model on one test experiment."""

    name: ClassVar[str]

    @abstractmethod
    def score(self, evaluation: Evaluation) -> Outcome:
        """Figures per output, in physical units."""


@dataclass(frozen=True)
class FreeRun(Task):
    """The whole experiment simulated from its first n_init measured outputs; none after them is used."""

    name: ClassVar[str] = "free_run"

    def score(self, evaluation: Evaluation) -> Outcome:
        """Score rows n_init .. T-1."""
        y = evaluation.experiment.y[evaluation.n_init :]
        return Outcome(score_outputs(y, evaluation.free_run, evaluation.channels), is_finite(evaluation.free_run))


@dataclass(frozen=True)
class Differences(Task):
    """The free run again, scored on its differences from sample to sample (the paper's "delta" set, section 3.8)."""

    name: ClassVar[str] = "differences"

    def score(self, evaluation: Evaluation) -> Outcome:
        """Score y(k) - y(k-1) for rows n_init .. T-1; the first one starts at the last measured sample."""
        start = evaluation.experiment.y[evaluation.n_init - 1 : evaluation.n_init]
        y = np.diff(evaluation.experiment.y[evaluation.n_init - 1 :], axis=0)
        y_hat = np.diff(np.concatenate((start, evaluation.free_run)), axis=0)
        return Outcome(score_outputs(y, y_hat, evaluation.channels), is_finite(y_hat))


@dataclass(frozen=True)
class Forecast(Task):
    """Forecasts of up to max(horizons) samples, each started from n_init measured outputs of its own.

    The error h samples ahead is `rmse_by_horizon["h"]`; "all" is the RMSE of the free run, for comparison. At
    most `windows` starts, evenly spread over the experiment. Horizons longer than the record are left out.
    Raises UnusableInput for horizons that are not increasing from 1 on.
    """

    name: ClassVar[str] = "forecast"
    horizons: tuple[int, ...] = (1, 2, 5, 10, 20, 50)
    windows: int = 1000

    def __post_init__(self) -> None:
        if self.horizons[:1] != (1,) or list(self.horizons) != sorted(set(self.horizons)):
            raise UnusableInput(f"the horizons {self.horizons} must start at 1 and increase")

    def score(self, evaluation: Evaluation) -> Outcome:
        """Score all steps 1 .. max(horizons) of all windows together, and each horizon by itself."""
        experiment, n_init = evaluation.experiment, evaluation.n_init
        length = min(self.horizons[-1], len(experiment) - n_init)
        starts = self.starts(len(experiment) - n_init - length)
        rows = starts[:, None] + np.arange(n_init + length)  # [B, n_init + length]
        u, y = experiment.u[rows], experiment.y[rows]  # [B, n_init + length, nu or ny]
        y_hat = evaluation.simulate(u, y[:, :n_init])  # [B, length, ny]
        y = y[:, n_init:]

        ny = y.shape[2]
        metrics = score_outputs(y.reshape(-1, ny), y_hat.reshape(-1, ny), evaluation.channels)
        for i, channel in enumerate(evaluation.channels.outputs):
            ahead = [h for h in self.horizons if h <= length]
            by_horizon = {str(h): score(y[:, h - 1, i], y_hat[:, h - 1, i])["rmse"] for h in ahead}
            by_horizon["all"] = score(experiment.y[n_init:, i], evaluation.free_run[:, i])["rmse"]
            metrics[channel.name]["rmse_by_horizon"] = by_horizon
        return Outcome(metrics, is_finite(y_hat) and is_finite(evaluation.free_run))

    def starts(self, last: int) -> Int[np.ndarray, " B"]:
        """First rows of the windows, from 0 to `last`."""
        return np.unique(np.linspace(0, last, min(self.windows, last + 1)).round().astype(int))


TASKS: dict[str, type[Task]] = {task.name: task for task in (FreeRun, Forecast, Differences)}
USUAL = (FreeRun.name, Forecast.name)  # what a suite asks for unless it says otherwise
