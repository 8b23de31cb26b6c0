"""Simulated test rigs with one or two physical effects hidden in them, to try a diagnosis on.

Whoever diagnoses gets what a measurement would give: inputs, noisy outputs, units. What was hidden is written
here from the physics, integrated at a fine step, and shares no code with the effects that a diagnosis knows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.random import Generator, default_rng
from scipy.signal import lfilter

from simgap.data.simulated.rig_kernels import Body, Drive, Tanks, fill, move
from simgap.records import Channel, Channels, Dataset, Experiment, TrainingSet

N_INIT = 20
SUBSTEPS = 20  # of the integration, per sample


@dataclass(frozen=True)
class Rig:
    """A plant before anything is hidden in it. U is its unit of input, L of length or level, Y of its first output.

    With `outflow` 0 it is a body: x'' = gain u - damping x' - stiffness x. Otherwise it is a tank, level' =
    gain u - outflow level, or two, of which the lower is measured.
    """

    name: str
    dt: float  # s
    input: Channel
    outputs: tuple[Channel, ...]
    gain: float  # L/s^2 per U; tanks: L/s per U
    amplitude: float  # U, the largest input; tanks: around an operating point of the same size
    reach: float  # Y, about the largest reading of the first output
    damping: float = 0.0  # 1/s
    stiffness: float = 0.0  # 1/s^2
    outflow: float = 0.0  # 1/s
    upper: float = 0.0  # 1/s, outflow of the upper tank, if there is one
    start: tuple[float, float] = (0.0, 0.0)  # spread of the initial x and v in L and L/s; tanks: of the levels
    # What the effects need besides their strength.
    breakaway: float = 2.0  # Stribeck: friction at rest as a multiple of that at high speed
    stribeck_velocity: float = 1.0  # L/s
    period: float = 1.0  # L, of the force over position
    ripple_period: float = 1.0  # L, of the gain over position
    hysteresis_width: float = 1.0  # L
    push_width: float = 1.0  # L
    frequency: float = 1.0  # Hz, of the periodic disturbance
    outlier: float = 1.0  # Y
    n_train: int = 8
    n_valid: int = 4
    n_test: int = 4
    samples: int = 300

    @property
    def channels(self) -> Channels:
        return Channels((self.input,), self.outputs)

    @property
    def middle(self) -> tuple[float, float]:
        """L, levels of the lower and the upper tank at the operating point; zero for a body."""
        flow = self.gain * self.amplitude if self.outflow else 0.0
        return (flow / self.outflow if flow else 0.0, flow / self.upper if flow and self.upper else 0.0)


VOLT, LEVEL = Channel("u", "V"), (Channel("level", "cm", "level"),)

RIGS = {
    rig.name: rig
    for rig in (
        Rig(
            "cart", 0.1, Channel("force", "N"), (Channel("v", "m/s", "velocity"),),
            gain=0.8, amplitude=4.0, reach=1.6, damping=1.6, start=(0.0, 0.4),
            stribeck_velocity=0.15, hysteresis_width=0.2, frequency=0.31, outlier=2.4,
        ),
        Rig(
            "stage", 0.05, VOLT, (Channel("x", "mm", "position"),),
            gain=50.0, amplitude=5.0, reach=10.0, damping=4.0, stiffness=25.0, start=(2.0, 10.0),
            stribeck_velocity=3.0, period=6.0, ripple_period=9.0, hysteresis_width=2.0, push_width=4.0,
            frequency=0.43, outlier=13.0,
        ),
        Rig(
            "slide", 0.1, VOLT, (Channel("x", "cm", "position"), Channel("v", "cm/s", "velocity")),
            gain=10.0, amplitude=5.0, reach=25.0, damping=2.4, stiffness=2.0, start=(4.0, 5.0),
            stribeck_velocity=3.0, period=10.0, ripple_period=20.0, hysteresis_width=3.0, push_width=8.0,
            frequency=0.23, outlier=30.0,
        ),
        Rig(
            "tank", 2.0, VOLT, LEVEL,
            gain=0.08, amplitude=4.0, reach=16.0, outflow=0.032, start=(2.0, 0.0), frequency=0.007, outlier=10.0,
        ),
        Rig(
            "tanks", 4.0, VOLT, LEVEL,
            gain=0.07, amplitude=4.0, reach=16.0, outflow=0.028, upper=0.04, start=(2.0, 1.5), frequency=0.0037,
            outlier=10.0,
        ),
    )
}  # fmt: skip


class Hidden(NamedTuple):
    """The size of an effect at strength 1 on each rig, None where it makes no sense; `field` is where it acts."""

    field: str
    unit: str  # U: of the input, Y: of the first output, L: of length or level
    cart: float | None
    stage: float | None
    slide: float | None
    tank: float | None
    tanks: float | None


CATALOGUE = {
    "dead_zone": Hidden("dead_zone", "U, each way", 1.0, 1.2, 1.2, 2.0, 2.0),
    "input_saturation": Hidden("limit", "U, each way", 1.2, 1.5, 1.5, 4.5, 4.5),
    "asymmetric_gain": Hidden("asymmetry", "share", 0.4, 0.4, 0.4, None, None),
    "backlash": Hidden("gap", "U, whole gap", 1.6, 2.0, 2.0, 2.0, 2.0),
    "input_delay": Hidden("delay", "s", 0.4, 0.1, 0.3, 12.0, 24.0),
    "actuator_lag": Hidden("lag", "s", 0.5, 0.1, 0.4, 16.0, 40.0),
    "gain_fade": Hidden("fade", "share lost at the end", 0.7, 0.7, 0.7, 0.2, 0.2),
    "constant_load": Hidden("load", "L/s^2", 0.5, 50.0, 7.0, None, None),
    "coulomb_friction": Hidden("coulomb", "L/s^2", 0.6, 50.0, 10.0, None, None),
    "stribeck_friction": Hidden("stribeck", "L/s^2 at high speed", 0.4, 40.0, 8.0, None, None),
    "quadratic_drag": Hidden("drag", "1/L", 1.5, 0.3, 0.2, None, None),
    "quadratic_stiffness": Hidden("stiffness2", "1/(L s^2)", None, 0.45, 0.02, None, None),
    "cubic_stiffness": Hidden("stiffness3", "1/(L^2 s^2)", None, 0.3, 0.01, None, None),
    "position_torque": Hidden("position_force", "L/s^2", None, 60.0, 12.0, None, None),
    "periodic_disturbance": Hidden("periodic", "L/s^2", 0.8, 50.0, 10.0, 0.06, 0.06),
    "hysteresis": Hidden("hysteresis", "L/s^2 at saturation", 0.6, 50.0, 10.0, None, None),
    "sqrt_outflow": Hidden("root", "share", None, None, None, 1.0, 1.0),
    "overflow": Hidden("rim", "L", None, None, None, 11.0, 11.0),
    "sensor_drift": Hidden("drift", "Y/s, standard deviation", 0.02, 0.2, 0.15, 0.0025, 0.002),
    "sensor_bias": Hidden("bias", "Y, standard deviation", 0.3, 2.0, 3.0, 0.9, 1.2),
    "sensor_saturation": Hidden("sensor_limit", "Y, each way", 0.5, 4.0, 7.0, 11.0, 11.0),
    "sensor_lag": Hidden("sensor_lag", "s", 0.5, 0.1, 0.4, 16.0, 40.0),
    "absolute_sensor": Hidden("absolute", "", 1.0, 1.0, 1.0, None, None),
    "quantisation": Hidden("step", "Y", 0.6, 4.0, 7.0, 2.5, 3.0),
    "outliers": Hidden("outlier_rate", "share of the samples", 0.02, 0.02, 0.02, 0.02, 0.02),
}
OUTSIDE = {  # no diagnosis knows these by name
    "position_dependent_gain": Hidden("ripple", "share", None, 0.6, 0.6, None, None),
    "squared_input": Hidden("squared", "share", 1.0, 1.0, 1.0, 1.0, 1.0),
    "negative_damping": Hidden("push", "1/s", None, 5.0, 2.0, None, None),
    "missing_input": Hidden("missing", "L/s^2, tanks L/s, standard deviation", 0.7, 40.0, 12.0, 0.1, 0.1),
}

KINDS = ("steps", "sines", "triangle", "chirp")  # of input, by turns


def suitable(rig: str, outside: bool = False) -> tuple[str, ...]:
    """Names of the effects that make sense on a rig: those of the catalogue, or those outside of it."""
    return tuple(name for name, row in (OUTSIDE if outside else CATALOGUE).items() if getattr(row, rig) is not None)


def physical(rig: str, effects: Mapping[str, float]) -> dict[str, float]:
    """Effect -> its true size on a rig in physical units (the column `unit` of the table above).

    Sizes grow with the strength s; a limit comes down from the full range as full / (1 + s (full / strong - 1)).
    """
    if rig not in RIGS:
        raise ValueError(f"there is no rig {rig!r}; known are {', '.join(RIGS)}")
    sizes = {}
    for name, strength in effects.items():
        row = (CATALOGUE | OUTSIDE).get(name)
        strong = getattr(row, rig) if row else None
        if row is None or strong is None:
            known = ", ".join((*suitable(rig), *suitable(rig, outside=True)))
            raise ValueError(f"{name!r} cannot be hidden in {rig!r}; what can be: {known}")
        sizes[name] = strength * strong
        if row.field in {"limit", "sensor_limit", "rim"}:
            full = _top(RIGS[rig]) if row.field == "limit" else RIGS[rig].reach
            sizes[name] = full / (1 + strength * (full / strong - 1)) if strength > 0 else inf
        elif row.field == "absolute":
            sizes[name] = 1.0
    return sizes


def hide(
    rig: str,
    effects: Mapping[str, float],
    noise: float = 0.05,
    colour: float = 0.0,
    seed: int = 0,
    substeps: int = SUBSTEPS,
) -> Dataset:
    """Recordings of a rig with effects of the given strengths (1 strong, 0.5 medium, 0.25 weak) hidden in it.

    `noise` is the standard deviation of the added noise as a share of that of the true motion, `colour` its
    AR(1) coefficient from sample to sample. The sensors' effects hit the first output only. Inputs, initial
    states and noise draws depend on rig and seed alone.
    """
    size = {(CATALOGUE | OUTSIDE)[name].field: value for name, value in physical(rig, effects).items()}
    plant = RIGS[rig]
    counts = (plant.n_train, plant.n_valid, plant.n_test)
    # The seed of an experiment is its place in its split, so that no split depends on the size of another.
    places = [(split, number) for split, count in enumerate(counts) for number in range(count)]
    streams = [default_rng([list(RIGS).index(rig), seed, *place]).spawn(4) for place in places]
    inputs = [_input(plant, KINDS[place[1] % len(KINDS)], s[0]) for place, s in zip(places, streams, strict=True)]
    motions = [_motion(plant, size, u, s[1], s[2], substeps) for u, s in zip(inputs, streams, strict=True)]
    spread = np.std(np.concatenate([motion[::substeps] for motion in motions]), axis=0)  # [ny]
    records = []
    for number, (u, motion, stream) in enumerate(zip(inputs, motions, streams, strict=True)):
        y = _measured(plant, size, motion, noise * spread, colour, stream[3], substeps)
        records.append(Experiment(f"e{number:02d}", u[:, None], y, plant.dt))
    ends = np.cumsum(counts)
    train, valid, test = tuple(records[: ends[0]]), tuple(records[ends[0] : ends[1]]), tuple(records[ends[1] :])
    training = TrainingSet(train, valid, N_INIT, plant.channels)
    return Dataset(f"{rig}_{seed}", training, test, N_INIT, plant.channels)


def _top(rig: Rig) -> float:
    """The largest input, U."""
    return 2 * rig.amplitude if rig.outflow else rig.amplitude


def _input(rig: Rig, kind: str, rng: Generator) -> Float[np.ndarray, " T"]:
    """One experiment's input, held from sample to sample, of an amplitude of its own. U."""
    signal = {"steps": _steps, "sines": _sines, "triangle": _triangle, "chirp": _chirp}[kind](rig.samples, rng)
    u = rig.amplitude * rng.uniform(0.5, 1.0) * signal
    # A pump neither turns back nor exceeds its supply; both ends are reached, so that levels vary widely.
    return np.clip(rig.amplitude + 1.3 * u, 0.0, _top(rig)) if rig.outflow else u


def _steps(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    """Levels within 1, each held for 5 to 25 samples."""
    holds = rng.integers(5, 26, samples // 5)
    return np.repeat(rng.uniform(-1.0, 1.0, len(holds)), holds)[:samples]


def _sines(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    """Six sines with periods of 12 to 150 samples; the largest value is 1."""
    periods = np.geomspace(12, 150, 6) * rng.uniform(0.85, 1.15, 6)
    waves = np.sin(2 * np.pi * (np.arange(samples)[:, None] / periods + rng.random(6))).sum(axis=1)  # [T]
    return waves / np.abs(waves).max()


def _triangle(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    """Slow ramps to and fro between turning points of either sign, 25 to 60 samples apart."""
    turns = np.cumsum(rng.integers(25, 61, samples // 25 + 2)) - 25
    peaks = rng.uniform(0.4, 1.0, len(turns)) * (-1.0) ** (np.arange(len(turns)) + rng.integers(2))
    return np.interp(np.arange(samples), turns, peaks)


def _chirp(samples: int, rng: Generator) -> Float[np.ndarray, " T"]:
    """A sine whose period falls from about 120 to about 10 samples."""
    k = np.arange(samples) / samples
    slow, fast = samples / rng.uniform(100, 140), samples / rng.uniform(8, 14)  # periods per experiment
    return np.sin(2 * np.pi * (slow * k + (fast - slow) * k**2 / 2 + rng.random()))


def _motion(
    rig: Rig, size: Mapping[str, float], u: np.ndarray, start_rng: Generator, missing_rng: Generator, substeps: int
) -> Float[np.ndarray, "n ny"]:
    """The true outputs [T substeps, ny] under the input u [T], from an initial state that is drawn."""
    other = size.get("missing", 0.0) * _band(len(u) + 1, missing_rng)  # [T + 1]
    known = {"amplitude": _top(rig), "limit": size.get("limit", inf)}
    drive = Drive(**{field: known.get(field, size.get(field, 0.0)) for field in Drive._fields})
    offset, middle = rig.start * np.clip(start_rng.standard_normal(2), -2, 2), rig.middle
    first, second = (float(value) for value in offset + middle)
    if rig.outflow:
        known = {"gain": rig.gain, "outflow": rig.outflow, "upper": rig.upper, "rim": size.get("rim", inf)}
        known |= {"level": middle[0], "upper_level": middle[1], "spill": 0.5, "frequency": rig.frequency, "phase": 0.7}
        tanks = Tanks(**{field: known.get(field, size.get(field, 0.0)) for field in Tanks._fields})
        return fill(tanks, drive, u, other, first, second, rig.dt, substeps)[:, :1].copy()
    known = {field: getattr(rig, field) for field in Body._fields if hasattr(rig, field)}
    known |= {"position_period": rig.period, "position_phase": 1.0, "phase": 0.7}
    body = Body(**{field: known.get(field, size.get(field, 0.0)) for field in Body._fields})
    motion = move(body, drive, u, other, first, second, rig.dt, substeps)
    return motion[:, [{"position": 0, "velocity": 1}[output.kind] for output in rig.outputs]]


def _band(samples: int, rng: Generator) -> Float[np.ndarray, " n"]:
    """Band-limited noise of standard deviation about 1: twenty sines with periods of 10 to 100 samples."""
    frequencies, phases = rng.uniform(1 / 100, 1 / 10, 20), rng.random(20)
    return np.sin(2 * np.pi * (np.arange(samples)[:, None] * frequencies + phases)).sum(axis=1) / np.sqrt(10)


def _measured(
    rig: Rig,
    size: Mapping[str, float],
    motion: Float[np.ndarray, "n ny"],
    spread: Float[np.ndarray, " ny"],
    colour: float,
    rng: Generator,
    substeps: int,
) -> Float[np.ndarray, "T ny"]:
    """Readings at the samples: lag, absolute value, drift and bias, noise, limit, counts, outliers."""
    drift_rng, bias_rng, noise_rng, outlier_rng = rng.spawn(4)
    y = motion[::substeps].copy()
    first = motion[:, 0]
    if lag := size.get("sensor_lag", 0.0):
        # Exact where the motion is straight within a substep; the sensor has settled before the first sample.
        h = rig.dt / substeps
        keep = np.exp(-h / lag)
        old = lag / h * (1 - keep) - keep  # weight of the row before
        first = first[0] + lfilter([1 - keep - old, old], [1, -keep], first - first[0])
    reading = first[::substeps].copy()
    if "absolute" in size:
        reading = np.abs(reading)
    reading += size.get("bias", 0.0) * bias_rng.standard_normal()
    reading += size.get("drift", 0.0) * drift_rng.standard_normal() * rig.dt * np.arange(len(reading))
    y[:, 0] = reading
    draws = noise_rng.standard_normal(y.shape)
    draws[1:] *= np.sqrt(1 - colour**2)
    y += spread * lfilter([1.0], [1.0, -colour], draws, axis=0)
    limit, step = size.get("sensor_limit", inf), size.get("step", 0.0)
    y[:, 0] = np.clip(y[:, 0], -limit, limit)
    if step:
        y[:, 0] = step * np.round(y[:, 0] / step)
    hit = outlier_rng.random(len(y)) < size.get("outlier_rate", 0.0)
    y[:, 0] += rig.outlier * hit * outlier_rng.choice(np.array([-1.0, 1.0]), len(y))
    return y
