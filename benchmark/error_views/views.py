"""What a free-run simulation gets wrong: its error, seen the ways a control engineer looks at it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

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
from simgap.findings import Wrong
from simgap.metrics import is_finite
from simgap.records import Channels, Experiment
from simgap.wording import percent

NEGLIGIBLE = 1e-12  # an error this much smaller than the signal is rounding
SMALLEST = 1e-150  # whose square is still a float


def views(
    experiments: Sequence[Experiment],
    simulated: Sequence[np.ndarray],
    channels: Channels,
    n_init: int,
    seed: int = 0,
) -> list[Wrong]:
    """Every view of the error e = y - y_hat of every output, the one that explains most first.

    `simulated[i]` [T - n_init, ny] holds rows n_init .. T-1 of the free run of `experiments[i]`. All views are
    returned, also those that chance explains: keep those with chance < 0.01, or less where many are looked at.
    Shares overlap and do not add up to 1, because the variables of a motion depend on each other. A simulation that
    diverged is left out; an output without error has no views.
    """
    pairs = [(x, y_hat) for x, y_hat in zip(experiments, simulated, strict=True) if len(y_hat) and is_finite(y_hat)]
    found: list[Wrong] = []
    for output in range(len(channels.outputs) if pairs else 0):
        e = errors(pairs, channels, output, n_init, seed)
        size = np.abs(e.y_hat[:, output] + e.error).max()
        if np.abs(e.error).max() > max(NEGLIGIBLE * size, SMALLEST):
            found += _views_of_output(e, output)
    return sorted(found, key=lambda view: -view.share)


def _views_of_output(e: Errors, output: int) -> Iterator[Wrong]:
    yield from trends.offset(e)
    if np.ptp(e.error) <= 1e-9 * np.abs(e.error).max():
        return  # a constant has no other sides
    for trend in (trends.time_since_start, trends.drift, trends.experiments, trends.band):
        yield from trend(e)
    for view, unit, bins in (*_by_input(e), *_by_motion(e, output)):
        if bins is not None:
            yield _binned(e, view, unit, bins)


def _by_input(e: Errors) -> Iterator[tuple[str, str, Bins | None]]:
    for i, channel in enumerate(e.channels.inputs):
        name = f"input {channel.name}"
        yield name, channel.unit, bin_values(e.u[:, i], name, channel.unit)


def _by_motion(e: Errors, output: int) -> Iterator[tuple[str, str, Bins | None]]:
    """Velocity, position and the like, of the simulated output: what they are depends on its kind."""
    own, unit, name = e.y_hat[:, output], e.channel.unit, e.channel.name
    change = by_experiment(lambda part: derivative(part, e.dt), own, e.lengths)
    amplitudes = by_experiment(amplitude, own, e.lengths)
    yield "amplitude", unit, bin_values(amplitudes, f"local RMS of simulated {name}", unit)
    if e.channel.kind in ("level", "other"):
        value = "level" if e.channel.kind == "level" else "value"
        yield value, unit, bin_values(own, f"simulated {name}", unit)
        yield "rate of change", rate(unit), bin_values(change, "rate of change", rate(unit))
        return
    if e.channel.kind == "position":
        v, v_unit = change, rate(unit)
        yield "position", unit, bin_values(own, "position", unit)
    else:
        v, v_unit = own, unit
        for i, other in enumerate(e.channels.outputs):
            if other.kind == "position":
                place = f"position {other.name}"
                yield place, other.unit, bin_values(e.y_hat[:, i], place, other.unit)
    yield "velocity", v_unit, bin_values(v, "velocity", v_unit)
    yield "sign of velocity", "", bin_direction(v, unit)
    yield "time since reversal", "s", bin_reversals(v, e.lengths, e.dt, unit)


def _binned(e: Errors, view: str, unit: str, bins: Bins) -> Wrong:
    """The view of the mean error in bins. Where bins have parents, what they add to the means of the parents."""
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
    return Wrong(view, name, share, p, text, bins.centres, tuple(map(float, mean)), unit)


def _extremes(mean: Float[np.ndarray, " B"], count: np.ndarray, parents: np.ndarray) -> tuple[int, int]:
    """The bins with the highest and lowest mean, both of the parent within which the means differ most."""
    of_parent = (np.bincount(parents, count * mean) / np.bincount(parents, count))[parents]
    inner = np.bincount(parents, count * (mean - of_parent) ** 2)
    among = np.flatnonzero(parents == np.argmax(inner))
    return int(among[np.argmax(mean[among])]), int(among[np.argmin(mean[among])])
