"""Scales of a plant's signals, from the data and a first linear model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.ndimage import median_filter

from simgap.greybox import dynamics
from simgap.greybox.effects.scales import SignalScales
from simgap.greybox.fitting import Estimate
from simgap.greybox.problem import Problem
from simgap.greybox.samples import Records
from simgap.greybox.terms import PlantScales
from simgap.records import Channels

MAX_LINES = 3
AROUND = 20  # lines on each side that one is compared with


def scales_of(estimate: Estimate, problem: Problem, channels: Channels, outputs: Sequence[int]) -> PlantScales:
    """Measure the scales that effects choose bounds and starts by, for each input and each of the plant's outputs."""
    plant, records = estimate.plant, problem.records
    x, v = (signal[records.mask] for signal in problem.simulator.motion(estimate.theta, estimate.local))  # [N]
    drive = problem.simulator.drive.of(estimate.theta)[:, :: problem.simulator.substeps][records.mask]
    arriving = problem.simulator.drive.u[:, :, :: problem.simulator.substeps]
    # What would move the output by its size within the longest record, where the input does nothing.
    force = float(np.std(drive)) or float(records.sizes[0]) / records.duration ** (
        1 if plant.cascade else plant.force_order
    )
    size = float(records.sizes[0])
    force = size if plant.by_rate else force  # what drives such a motion is not measured
    x_max = float(np.max(np.abs(x))) or size
    v_max = float(np.max(np.abs(v))) or size / records.duration

    rate = "/s" if plant.by_rate else ""
    errors = estimate.errors[:, :, 0]
    together, whatever_phase = lines(errors, records.dt, records.past.since), tones(errors, records.dt)

    def scales(i: int, j: int) -> SignalScales:
        u, y = arriving[i][records.mask], records.y[records.mask][:, j]
        return SignalScales(
            kind=plant.kind, order=plant.force_order, dt=plant.dt, duration=records.duration,
            u_low=float(u.min()), u_high=float(u.max()), u_rms=float(np.sqrt(np.mean(u * u))),
            y_low=float(y.min()), y_high=float(y.max()), y_rms=float(np.std(y)),
            x_max=x_max, v_max=v_max, stroke=_stroke(x, v_max, records) if plant.order == 1 or plant.swings else x_max,
            force_rms=force,
            u_unit=channels.inputs[i].unit.removesuffix(rate), y_unit=channels.outputs[outputs[j]].unit,
            lines=together, tones=whatever_phase,
            quantisation_step=float(records.steps[j]),
        )  # fmt: skip

    poles = dynamics.poles(plant, estimate.theta) if plant.order else np.zeros(1)
    at_inputs, at_outputs = tuple(scales(i, 0) for i in range(plant.nu)), tuple(scales(0, j) for j in range(plant.ny))
    return PlantScales(at_inputs, at_outputs, float(np.max(np.abs(poles))))


def _stroke(v: np.ndarray, v_max: float, records: Records) -> float:
    # Where only a velocity is measured: its integral between two changes of sign, at most.
    crossings = np.flatnonzero(np.diff(np.sign(v)) != 0)
    longest = np.max(np.diff(crossings), initial=10)
    return v_max * records.dt * float(min(longest, 200)) * 0.5


def lines(e: Float[np.ndarray, "E T"], dt: float, since: Float[np.ndarray, " E"]) -> tuple[float, ...]:
    """Find the frequencies in Hz at which the errors of all experiments agree in amplitude and phase, over the run."""
    begins = np.round(since / dt).astype(int)
    together = np.zeros(begins.max() + e.shape[1])  # where several runs were recorded, one on top of the other
    for begin, of_record in zip(begins, e, strict=True):
        together[begin : begin + len(of_record)] += of_record
    n = 1 << int(np.ceil(np.log2(4 * len(together))))
    return _peaks(np.abs(np.fft.rfft(together, n)) ** 2, np.fft.rfftfreq(n, dt), dt * e.shape[1])


def tones(e: Float[np.ndarray, "E T"], dt: float) -> tuple[float, ...]:
    """Find the frequencies in Hz that stand out from those around them in the errors, whatever their phase."""
    n = 1 << int(np.ceil(np.log2(4 * e.shape[1])))
    power = np.sum(np.abs(np.fft.rfft(e, n)) ** 2, axis=0)
    around = median_filter(power, size=1 + 2 * AROUND * n // e.shape[1], mode="nearest")
    return _peaks(power / np.maximum(around, 1e-300), np.fft.rfftfreq(n, dt), dt * e.shape[1])


def _peaks(power: np.ndarray, frequencies: np.ndarray, duration: float) -> tuple[float, ...]:
    """List the highest peaks of a spectrum, one for each line that records of this length resolve."""
    power[frequencies < 0.7 / duration] = 0.0
    found: list[float] = []
    for _ in range(MAX_LINES):
        peak = int(np.argmax(power))
        if power[peak] <= 0:
            break
        found.append(float(frequencies[peak]))
        power[np.abs(frequencies - frequencies[peak]) < 1.0 / duration] = 0.0
    return tuple(found)
