"""A saved model on other records of the machine that it was fitted on."""

from __future__ import annotations

import csv
import os
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.data.loading import read_recordings
from simgap.metrics import score_outputs
from simgap.records import Channel, Channels, Experiment, UnusableInput, same_sampling_time
from simgap.running.fitting import CheckedSimulation
from simgap.saved.archive import FittedOn, SavedModel, read_saved
from simgap.units import plain


@dataclass(frozen=True, eq=False)
class Simulation:
    """The free run of one experiment: y_hat [T-n_init, ny] are its rows n_init .. T-1."""

    experiment: Experiment
    channels: Channels
    n_init: int
    y_hat: Float[np.ndarray, "N ny"]

    @cached_property
    def metrics(self) -> dict[str, dict[str, Any]]:
        """Figures per output, as those of a test experiment: rmse, fit_percent, ..."""
        return score_outputs(self.experiment.y[self.n_init :], self.y_hat, self.channels)

    def rows(self) -> Iterator[list[Any]]:
        """Yield the header, then time in s, inputs, measured and simulated outputs of every sample.

        The first n_init samples are not simulated; there the cells are empty.
        """
        inputs, outputs = ([c.name for c in part] for part in (self.channels.inputs, self.channels.outputs))
        taken = {*inputs, *outputs}
        time = next(name for name in ("time", "t", "seconds") if name not in taken)
        yield [time, *inputs, *outputs, *(f"{name}_simulated" for name in outputs)]
        x, missing = self.experiment, [[""] * len(outputs)] * self.n_init
        for t, (u, y, y_hat) in enumerate(zip(x.u.tolist(), x.y.tolist(), missing + self.y_hat.tolist(), strict=True)):
            yield [f"{t * x.dt:.12g}", *u, *y, *y_hat]

    def write(self, file: str | Path) -> None:
        """Write the rows as CSV; inputs and outputs lose no bit."""
        with Path(file).open("w", encoding="utf-8", newline="") as stream:
            csv.writer(stream, lineterminator="\n").writerows(self.rows())


def simulate(
    saved: str | Path | SavedModel, data: Any, experiment: str | None = None, dt: float | None = None,
    resample: float | None = None, split_gaps: bool = False,
) -> list[Simulation]:  # fmt: skip
    """Let a saved model run free over other records, from their first n_init measured outputs.

    `saved` is a file of `save_model`, `data` what `simgap.load` takes: a file is simulated as a whole, of a data set
    the test experiments, or the one called `experiment`. dt in seconds, for files without a column of time; `resample`
    and `split_gaps` are those of `simgap.load`. Raises UnusableInput where columns, units or sampling time are not
    those that the model was fitted on.
    """
    saved = saved if isinstance(saved, SavedModel) else read_saved(saved)
    return [
        _simulated(saved, x) for x in matching_experiments(saved.fitted_on, data, experiment, dt, resample, split_gaps)
    ]


def matching_experiments(
    about: FittedOn, data: Any, experiment: str | None = None, dt: float | None = None,
    resample: float | None = None, split_gaps: bool = False, every: bool = False,
) -> list[Experiment]:  # fmt: skip
    """Read the records that `simulate` takes, for a model that was fitted on such data; or `every` one of a data set.

    Raises UnusableInput.
    """
    recordings = read_recordings(data, about.channels, dt, resample, split_gaps)
    source = os.fspath(data) if isinstance(data, str | os.PathLike) else "the data"
    for role in ("inputs", "outputs"):
        _check_columns(source, role, getattr(recordings.channels, role), getattr(about.channels, role))
    chosen = _chosen(source, recordings.experiments, recordings.others, experiment)
    chosen = [*recordings.experiments, *recordings.others] if every else chosen
    for x in chosen:
        _check_samples(about, source, x)
    return list(chosen)


def _check_columns(source: str, role: str, given: tuple[Channel, ...], fitted: tuple[Channel, ...]) -> None:
    names, wanted = [c.name for c in given], [c.name for c in fitted]
    if names != wanted:
        raise UnusableInput(
            f"{source}: the {role} are {', '.join(names)}, the model was fitted on {', '.join(wanted)}; "
            f"give the same columns in the same order"
        )
    for one, other in zip(given, fitted, strict=True):
        if one.unit and other.unit and plain(one.unit) != plain(other.unit):
            raise UnusableInput(
                f"{source}: {one.name} is in {one.unit}, the model was fitted on {other.unit}; convert the column"
            )


def _chosen(
    source: str, experiments: tuple[Experiment, ...], others: tuple[Experiment, ...], name: str | None
) -> tuple[Experiment, ...]:
    """The experiments to simulate: all to test on, or the first of all that has the name."""
    if name is None:
        return experiments
    known = experiments + others
    if found := [x for x in known if x.name == name]:
        return (found[0],)
    there = ", ".join(dict.fromkeys(x.name for x in known))
    raise UnusableInput(f"{source}: there is no experiment {name!r}; there are {there}")


def _check_samples(about: FittedOn, source: str, x: Experiment) -> None:
    if not same_sampling_time(x.dt, about.dt):
        raise UnusableInput(
            f"{source}: {x.name} is sampled every {x.dt:g} s, the model was fitted on {about.dt:g} s; resample the data"
        )
    if len(x) <= about.n_init:
        raise UnusableInput(
            f"{source}: {x.name} has {len(x)} samples, of which n_init = {about.n_init} start the simulation; "
            f"nothing is left to simulate"
        )


def _simulated(saved: SavedModel, x: Experiment) -> Simulation:
    about = saved.fitted_on
    run = CheckedSimulation(saved.model, len(about.channels.outputs))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # an overflow shows in the figures
        y_hat = run(x.u[None], x.y[None, : about.n_init])[0]
    return Simulation(x, about.channels, about.n_init, y_hat)
