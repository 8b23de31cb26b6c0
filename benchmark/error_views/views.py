"""All views of the error of a free run: against time, experiments, frequency, input and motion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from simgap.error_views import chance, trends
from simgap.error_views.errors import Errors, errors
from simgap.error_views.variables import (
    Bins,
    amplitude,
    bin_direction,
    bin_reversals,
    bin_values,
    by_experiment,
    derivative,
)
from simgap.error_views.wording import mean_error, rate
from simgap.error_views.wrong import ViewName, Wrong
from simgap.metrics import is_finite
from simgap.records import Channels, Experiment
from simgap.wording import percent

NEGLIGIBLE = 1e-12  # an error this much smaller than the signal is rounding
SMALLEST = 1e-150  # an error whose square is still a float


def views(
    experiments: Sequence[Experiment],
    simulated: Sequence[np.ndarray],
    channels: Channels,
    n_init: int,
    seed: int = 0,
) -> list[Wrong]:
    """View the error e = y - y_hat of every output in every way; the view that explains most comes first.

    `simulated[i]` [T - n_init, ny] holds rows n_init .. T-1 of the free run of `experiments[i]`. Views that chance
    explains are returned too: keep those with chance < 0.01, or less where many are looked at. Shares do not add up
    to 1, because the variables of a motion depend on each other. A simulation that diverged is left out; an output
    without error has no views.
    """
    pairs = [(x, y_hat) for x, y_hat in zip(experiments, simulated, strict=True) if len(y_hat) and is_finite(y_hat)]
    seen: list[Wrong] = []
    for output in range(len(channels.outputs) if pairs else 0):
        e = errors(pairs, channels, output, n_init, seed)
        size = np.abs(e.y_hat[:, output] + e.error).max()
        if np.abs(e.error).max() > max(NEGLIGIBLE * size, SMALLEST):
            seen += _views_of_output(e, output)
    return sorted(seen, key=lambda view: -view.share)


def _views_of_output(e: Errors, output: int) -> Iterator[Wrong]:
    yield from trends.offset(e)
    if np.ptp(e.error) <= 1e-9 * np.abs(e.error).max():
        return  # a constant error depends on nothing
    for trend in (trends.time_since_start, trends.drift, trends.experiments, trends.band):
        yield from trend(e)
    for variable in (*_inputs(e), *_motion(e, output)):
        if variable.bins is not None:
            yield _binned(e, variable, variable.bins)


class _Variable(NamedTuple):
    """A variable that the error is held against, in the view of that name."""

    view: ViewName
    unit: str
    bins: Bins | None
    channel: str = ""  # of the variable, unless it is the output itself


def _inputs(e: Errors) -> Iterator[_Variable]:
    for i, channel in enumerate(e.channels.inputs):
        bins = bin_values(e.u[:, i], f"input {channel.name}", channel.unit)
        yield _Variable("input", channel.unit, bins, channel.name)


def _motion(e: Errors, output: int) -> Iterator[_Variable]:
    """List the variables of motion that an output of this kind tells, as simulated."""
    y_hat, kind, unit, name = e.y_hat[:, output], e.channel.kind, e.channel.unit, e.channel.name
    slope = by_experiment(lambda part: derivative(part, e.dt), y_hat, e.lengths)
    amplitudes = by_experiment(amplitude, y_hat, e.lengths)
    yield _Variable("amplitude", unit, bin_values(amplitudes, f"amplitude (local RMS) of simulated {name}", unit))
    if kind in ("level", "other"):
        yield _Variable("level" if kind == "level" else "value", unit, bin_values(y_hat, f"simulated {name}", unit))
        yield _Variable("rate of change", rate(unit), bin_values(slope, "rate of change", rate(unit)))
        return
    if kind == "position":
        v, v_unit = slope, rate(unit)
        yield _Variable("position", unit, bin_values(y_hat, "position", unit))
    else:
        v, v_unit = y_hat, unit
        for i, other in enumerate(e.channels.outputs):
            if other.kind == "position":
                bins = bin_values(e.y_hat[:, i], f"position {other.name}", other.unit)
                yield _Variable("position", other.unit, bins, other.name)
    yield _Variable("velocity", v_unit, bin_values(v, "velocity", v_unit))
    yield _Variable("sign of velocity", "", bin_direction(v, unit))
    yield _Variable("time since reversal", "s", bin_reversals(v, e.lengths, e.dt, unit))


def _binned(e: Errors, variable: _Variable, bins: Bins) -> Wrong:
    """Compute the mean error in bins; where bins have parents, their share is what they add to the parents' means."""
    n = len(bins.centres)
    parents = np.array(bins.parents or [0] * n)
    share, p = chance.by_bins(e.error, bins.labels, e.lengths, e.seed, bins.parents)
    inside = bins.labels >= 0
    count = np.bincount(bins.labels[inside], minlength=n)
    mean = np.bincount(bins.labels[inside], e.error[inside], minlength=n) / count  # [B]
    high, low = _extremes(mean, count, parents)
    name, e_unit = e.channel.name, e.channel.unit
    text = (
        f"The simulation of {name} is {mean_error(mean[high], e_unit)} {bins.where[high]} and "
        f"{mean_error(mean[low], e_unit)} {bins.where[low]}: {percent(share)} of its squared error"
        f"{', beyond what the direction explains' if bins.parents else ''}."
    )
    error = tuple(map(float, mean))
    return Wrong(variable.view, name, share, p, text, bins.centres, error, variable.unit, variable.channel)


def _extremes(mean: Float[np.ndarray, " B"], count: np.ndarray, parents: np.ndarray) -> tuple[int, int]:
    """Find the bins with the highest and the lowest mean, within the parent whose bins differ most."""
    of_parent = (np.bincount(parents, count * mean) / np.bincount(parents, count))[parents]
    inner = np.bincount(parents, count * (mean - of_parent) ** 2)
    bins = np.flatnonzero(parents == np.argmax(inner))
    return int(bins[np.argmax(mean[bins])]), int(bins[np.argmin(mean[bins])])
