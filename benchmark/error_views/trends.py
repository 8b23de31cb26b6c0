"""Views of an error against time, over experiments, and in frequency bands."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Int

from simgap.error_views import chance
from simgap.error_views.correlation import blocks, means
from simgap.error_views.errors import Errors
from simgap.error_views.variables import bin_values
from simgap.error_views.wording import between, error, mean_error, rate, span
from simgap.error_views.wrong import ViewName, Wrong
from simgap.wording import amount, number, percent

OCTAVES = 2.0 ** np.arange(-6, 1)  # upper edges of the bands, as parts of the Nyquist frequency


def offset(e: Errors) -> Iterator[Wrong]:
    """View the mean error, as a sensor bias, a constant load or a wrong operating point leave it."""
    mean = float(e.error.mean())
    n = len(e.lengths)
    if np.ptp(e.error) <= 1e-9 * abs(mean):  # no noise to measure it against
        share, p = 1.0, 0.0 if len(e.error) >= 10 else 1.0
    elif n > 2:
        share, p = chance.by_experiments(e.error, e.experiment, np.zeros(n, dtype=int), 0.0)
    else:
        share, p = chance.by_trend(e.error, np.full(len(e.error), mean), 1, 1, e.experiment)
    text = f"The simulation of {e.channel.name} is {mean_error(mean, e.channel.unit)} on average: {_squared(share)}."
    yield Wrong("offset", e.channel.name, share, p, text, (0.0,), (mean,), "")


def time_since_start(e: Errors) -> Iterator[Wrong]:
    """View the mean error against the time since the start, and how the RMS error grows."""
    unit, seconds = e.channel.unit, e.sample * e.dt
    # Slow noise in few experiments looks like a trend, and many bins would remove what shows how slow it is.
    bins = bin_values(seconds, "time", "s", min(10, 1 + 2 * len(e.lengths)))
    if bins is None:
        return
    n, removed = len(bins.centres), len(e.lengths) + len(bins.centres) - 1
    fitted = means(e.error - means(e.error, e.experiment), bins.labels)
    share, p = chance.by_trend(e.error, fitted, n - 1, removed, e.experiment)
    mean = np.bincount(bins.labels, e.error) / np.bincount(bins.labels)
    rms = np.sqrt(np.bincount(bins.labels, e.error**2) / np.bincount(bins.labels))
    first, last = span(*bins.ends[0]), span(*bins.ends[-1])
    text = (
        f"The simulation of {e.channel.name} is {mean_error(mean[0], unit)} {first} after the start (RMS error "
        f"{error(rms[0], unit)}) and {mean_error(mean[-1], unit)} {last} after it (RMS error {error(rms[-1], unit)}): "
        f"{_squared(share)}."
    )
    yield Wrong("time since the start", e.channel.name, share, p, text, bins.centres, _floats(mean), "s")


def drift(e: Errors) -> Iterator[Wrong]:
    """View the drift: a straight line with a slope of its own in each experiment, shown as the means of its halves."""
    lengths, name, unit = np.array(e.lengths), e.channel.name, e.channel.unit
    if lengths.min() < 8:
        return
    count = len(lengths)
    time = (e.sample - (lengths[e.experiment] - 1) / 2) * e.dt  # s, from the middle of each experiment
    slope = np.bincount(e.experiment, time * e.error) / np.bincount(e.experiment, time**2)  # [E]
    share, p = chance.by_trend(e.error, time * slope[e.experiment], count, 2 * count, e.experiment)
    half = 2 * e.experiment + (2 * e.sample >= lengths[e.experiment])
    mean = np.bincount(half, e.error) / np.bincount(half)  # [2 E]
    shift = mean[1::2] - mean[::2]
    most = int(np.argmax(np.abs(shift)))
    text = (
        f"The measured {name} drifts against its simulation by {_signed(shift[most], unit)} from the first to the "
        f"second half of experiment {e.names[most]} ({_signed(slope[most], rate(unit))}"
        f"{', the most of all experiments' if count > 1 else ''}): {_squared(share)}."
    )
    at = tuple(float(i + side) for i in range(1, count + 1) for side in (-0.25, 0.25))
    yield Wrong("drift within experiment", name, share, p, text, at, _floats(mean), "")


def experiments(e: Errors) -> Iterator[Wrong]:
    """View the mean and the RMS error over experiments, and over kinds of experiments (the ends of their names)."""
    names, count = tuple(f"experiment {name}" for name in e.names), len(e.names)
    if count < 2:
        return
    fitted = means(e.error, e.experiment) - e.error.mean()
    each = np.arange(count)
    yield _by_mean(e, "experiment", names, each, *chance.by_trend(e.error, fitted, count - 1, count, e.experiment))
    sizes, owner = blocks(e.error, e.experiment)
    if np.bincount(owner, minlength=count).min() > 1:
        yield _by_size(e, "size by experiment", names, each, *chance.by_size(sizes, owner, e.seed))
    suffixes = [name.rsplit("_", 1)[-1] if "_" in name else "" for name in e.names]
    kinds, kind = np.unique(suffixes, return_inverse=True)
    if all(map(str.isalpha, kinds)) and np.count_nonzero(np.bincount(kind) > 1) > 1:
        labels = tuple(f"experiments of kind {name}" for name in kinds)
        share, p = chance.by_experiments(e.error, e.experiment, kind, float(e.error.mean()))
        yield _by_mean(e, "kind of experiment", labels, kind, share, p)
        sizes = np.bincount(e.experiment, e.error**2) / np.array(e.lengths)
        yield _by_size(e, "size by kind of experiment", labels, kind, *chance.by_size(sizes, kind, e.seed))


def band(e: Errors) -> Iterator[Wrong]:
    """View the power of the error in octaves below the Nyquist frequency."""
    nyquist, name = 0.5 / e.dt, e.channel.name
    centred = [part - part.mean() for part in e.parts()]
    # The line at zero frequency is left out: the mean of each experiment has a view of its own.
    power = np.concatenate([np.abs(np.fft.rfft(part)[1:]) ** 2 / len(part) for part in centred])
    frequency = np.concatenate([np.arange(1, len(part) // 2 + 1) / (len(part) / 2) for part in centred])
    label = np.searchsorted(OCTAVES, frequency * (1 - 1e-12))
    if len(power) < 10 or power.sum() <= 0:
        return
    best, share, p = chance.by_bands(power, label)
    edges = np.concatenate([[0.0], OCTAVES])
    low, high = edges[best], edges[best + 1]
    place = between(low * nyquist, high * nyquist, "Hz") if best else f"below {amount(high * nyquist, 'Hz')}"
    variance = sum(float(part @ part) for part in centred) / len(e.error)
    share = min(1.0, share * variance / float(np.mean(e.error**2)))
    text = (
        f"The error of {name} is strongest {place} ({number(low, 2)} to {number(high, 2)} of the Nyquist frequency): "
        f"{_squared(share)}, beyond what white noise would have there."
    )
    filled = np.unique(label)
    rms = np.sqrt(np.bincount(label, power)[filled] / power.sum() * variance)
    at = _floats((edges[filled] + edges[filled + 1]) / 2 * nyquist)
    yield Wrong("frequency band", name, share, p, text, at, _floats(rms), "Hz")


def _by_mean(
    e: Errors, view: ViewName, labels: tuple[str, ...], group: Int[np.ndarray, " E"], share: float, p: float
) -> Wrong:
    of_sample = group[e.experiment]
    mean = np.bincount(of_sample, e.error) / np.bincount(of_sample)
    high, low = int(np.argmax(mean)), int(np.argmin(mean))
    unit = e.channel.unit
    text = (
        f"The simulation of {e.channel.name} is {mean_error(mean[high], unit)} in {labels[high]} and "
        f"{mean_error(mean[low], unit)} in {labels[low]}: {_squared(share)}."
    )
    return Wrong(view, e.channel.name, share, p, text, _counted(mean), _floats(mean), "")


def _by_size(
    e: Errors, view: ViewName, labels: tuple[str, ...], group: Int[np.ndarray, " E"], share: float, p: float
) -> Wrong:
    of_sample = group[e.experiment]
    count, squared = np.bincount(of_sample), np.bincount(of_sample, e.error**2)
    rms = np.sqrt(squared / count)
    high, low = int(np.argmax(rms)), int(np.argmin(rms))
    most, least = error(rms[high], e.channel.unit), error(rms[low], e.channel.unit)
    text = (
        f"The RMS error of {e.channel.name} is {most} in {labels[high]} and {least} in {labels[low]}: "
        f"those above the average hold {percent(share)} more of the squared error than of the samples."
    )
    return Wrong(view, e.channel.name, share, p, text, _counted(rms), _floats(rms), "")


def _signed(value: float, unit: str) -> str:
    return ("+" if value > 0 else "") + error(value, unit)


def _squared(share: float) -> str:
    return f"{percent(share)} of its squared error"


def _floats(values: np.ndarray) -> tuple[float, ...]:
    return tuple(map(float, values))


def _counted(values: np.ndarray) -> tuple[float, ...]:
    return tuple(float(i) for i in range(1, len(values) + 1))
