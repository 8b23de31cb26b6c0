"""What is drawn of one fit: its free runs beside the measurement, and what they leave."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.records import Dataset
from simgap.reports.collection import Run
from simgap.reports.diagnosis.traces import axis_range
from simgap.reports.rendering import printable
from simgap.reports.site.curves import Chart, chart, curve, line
from simgap.reports.site.names import plot_text
from simgap.reports.site.residuals import correlation_charts
from simgap.reports.site.signals import MOST, stretches

FREQUENCIES = 300


def simulated(run: Run, dataset: Dataset) -> dict[str, Any]:
    """Pack simulation and error (measured minus simulated) of the records of `signals.measured`, in its order."""
    n = dataset.n_init
    records: list[Any] = []
    for experiment in dataset.test[:MOST]:
        y_hat = run.artefact.runs.get(experiment.name)
        t = experiment.dt * np.arange(n, len(experiment))
        for _, part in stretches(experiment, n):
            if y_hat is None or y_hat.shape != experiment.y[n:].shape:
                records.append(None)
                continue
            y, y_hat_part = experiment.y[n:][part], y_hat[part]
            error = y - y_hat_part
            records.append({
                "y": [curve(t[part], column) for column in y_hat_part.T],
                "e": [curve(t[part], column) for column in error.T],
                "range": [axis_range(a, [b]) for a, b in zip(y.T, y_hat_part.T, strict=True)],
                "error_range": [_error_range(*pair) for pair in zip(y.T, error.T, strict=True)],
            })  # fmt: skip
    return {"name": plot_text(run.standing.model), "label": printable(run.standing.model), "records": records}


def _error_range(y: Float[np.ndarray, " N"], error: Float[np.ndarray, " N"]) -> tuple[float, float] | None:
    """Cut the axis of an error that is so much larger than the signal that nothing else could be seen."""
    if np.isfinite(error).all() and float(np.abs(error).max()) <= 3 * float(np.ptp(y)):
        return None
    return axis_range(y - y.mean(), [error])


def charts(run: Run, dataset: Dataset | None) -> list[Chart]:
    """Draw the residual tests where the measurement is at hand, and poles and frequency response of a linear model."""
    found = [] if dataset is None else correlation_charts(run.artefact, dataset)
    if len(run.artefact.state_space) == 4:
        found += [_poles(run), *_bode(run, dataset)]
    return found


def _poles(run: Run) -> Chart:
    a = run.artefact.state_space[0]
    poles = np.linalg.eigvals(a) if len(a) else np.zeros(0)
    poles = poles[np.abs(poles) > 1e-6]  # those of a pure delay lie at zero
    angle = np.linspace(0, 2 * np.pi, 181)
    circle = line(np.cos(angle), np.sin(angle), "unit circle", role="bound")
    crosses = line(poles.real, poles.imag, "poles") | {"mode": "markers", "symbol": "x"}
    outside = int(np.sum(np.abs(poles) > 1))
    largest = f"the largest has a magnitude of {np.abs(poles).max():.4g}" if len(poles) else "there are none but delays"
    about = f"{len(poles)} poles of the simulation in the z plane, {outside} outside the unit circle; {largest}."
    return chart("Poles", "real part", "imaginary part", [circle, crosses], about, square=True)


def _bode(run: Run, dataset: Dataset | None) -> list[Chart]:
    """Draw G(z) = C (zI - A)^-1 B + D for z = exp(j omega dt)."""
    a, b, c, d = run.artefact.state_space
    dt = run.artefact.dt
    frequency = np.geomspace(1e-3, 0.5, FREQUENCIES) / dt
    z = np.exp(2j * np.pi * frequency * dt)
    inverse = np.linalg.solve(z[:, None, None] * np.eye(len(a)) - a, np.broadcast_to(b, (len(z), *b.shape)))
    response = c @ inverse + d  # [F, ny, nu]
    outputs = [(ch.name, ch.unit) for ch in dataset.channels.outputs] if dataset else None
    inputs = [(ch.name, ch.unit) for ch in dataset.channels.inputs] if dataset else None
    gains, phases = [], []
    for i, j in np.ndindex(*response.shape[1:]):
        way = f"{inputs[j][0]} to {outputs[i][0]}" if inputs and outputs else f"input {j + 1} to output {i + 1}"
        gains.append(line(frequency, np.abs(response[:, i, j]), plot_text(way)))
        phases.append(line(frequency, np.degrees(np.unwrap(np.angle(response[:, i, j]))), plot_text(way)))
    several = len(gains) > 1
    about = f"of the linear model from {1e-3 / dt:.3g} Hz to half the sampling frequency, {0.5 / dt:.3g} Hz."
    return [
        chart("Gain", "frequency [Hz]", "gain", gains, f"Gain {about}", log="xy", legend=several),
        chart("Phase", "frequency [Hz]", "phase [deg]", phases, f"Phase {about}", log="x", legend=several),
    ]
