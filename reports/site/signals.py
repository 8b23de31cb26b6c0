"""The signals of a data set: every experiment's inputs and outputs, and their spectra."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.records import Dataset, Experiment
from simgap.reports.rendering import printable
from simgap.reports.site.curves import POINTS, Chart, chart, curve, line
from simgap.reports.site.names import plot_text

DETAIL = 1000  # samples of a long record that are shown one by one
MOST = 40  # experiments of a page
SHORTEST = 16  # samples of which a spectrum says something


def stretches(experiment: Experiment, start: int) -> list[tuple[str, slice]]:
    """Name what is shown of an experiment from row `start` on: all of it, and first of a long one a part unthinned."""
    name, rows = experiment.name, len(experiment) - start
    if rows <= POINTS:
        return [(name, slice(0, rows))]
    first = rows // 2 - DETAIL // 2
    return [(f"{name}, {DETAIL} samples in the middle", slice(first, first + DETAIL)),
            (f"{name}, all {rows} samples", slice(0, rows))]  # fmt: skip


def measured(dataset: Dataset) -> dict[str, Any]:
    """Pack the test experiments from row n_init on, where simulations begin, thinned where they are long."""
    n = dataset.n_init
    records = []
    for experiment in dataset.test[:MOST]:
        t = experiment.dt * np.arange(n, len(experiment))
        for name, part in stretches(experiment, n):
            u = [curve(t[part], column[part]) for column in experiment.u[n:].T]
            y = [curve(t[part], column[part]) for column in experiment.y[n:].T]
            records.append({"name": printable(name), "u": u, "y": y})
    channels = dataset.channels
    return {
        "inputs": [plot_text(c.name, c.unit) for c in channels.inputs],
        "outputs": [plot_text(c.name, c.unit) for c in channels.outputs],
        "records": records,
    }


def spectra(dataset: Dataset) -> list[Chart]:
    """Draw the amplitude spectral density of inputs and outputs, over all training experiments."""
    charts = []
    channels = dataset.channels
    named = [("input", "u", i, c) for i, c in enumerate(channels.inputs)]
    named += [("output", "y", i, c) for i, c in enumerate(channels.outputs)]
    for role, signal, i, channel in named:
        records = [getattr(experiment, signal)[:, i] for experiment in dataset.training.train]
        found = _density(records, dataset.training.dt)
        if found is None:
            continue
        frequency, density = found
        title = plot_text(channel.name, f"{channel.unit}/√Hz" if channel.unit else "1/√Hz")
        charts.append(chart(
            f"{role} {title}", "frequency [Hz]", title, [line(frequency, density)],
            f"Amplitude spectral density of the {role} {channel.name} over the training experiments (Welch 1967); "
            f"the largest is at {frequency[np.argmax(density)]:.3g} Hz.", log="xy",
        ))  # fmt: skip
    return charts


def _density(records: list[np.ndarray], dt: float) -> tuple[Float[np.ndarray, " F"], Float[np.ndarray, " F"]] | None:
    """Average the spectra of segments of one length; records shorter than that are left out."""
    from scipy.signal import welch

    segment = min(1024, sorted(map(len, records))[len(records) // 2])
    long_enough = [record for record in records if len(record) >= segment >= SHORTEST]
    if not long_enough:
        return None
    found = [welch(record, fs=1 / dt, nperseg=segment, detrend="constant") for record in long_enough]
    power = np.average([density for _, density in found], axis=0, weights=list(map(len, long_enough)))
    return found[0][0][1:], np.sqrt(power[1:])
