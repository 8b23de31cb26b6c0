"""The library of SINDy, widened with the laws behind our effects: columns of the input, and of the state."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.signal import lfilter

LINEAR = ""  # the name of a column that is no effect
DELAYS, LAGS = (1, 2, 3, 4, 6), (1.0, 2.0, 4.0, 8.0)  # samples
SHARES = (0.1, 0.2, 0.35, 0.5, 0.7)  # of the largest input: widths and limits
PERIODS = (0.2, 0.3, 0.4, 0.55, 0.75, 1.0)  # of the range of the position

Column = tuple[str, np.ndarray]


def of_input(u: Float[np.ndarray, " T"], largest: float, step: float) -> Iterator[Column]:
    """Yield the effect and the values of each column that an input gives by itself.

    `largest` is the largest input of all records, `step` the largest change from sample to sample.
    """
    yield LINEAR, u
    yield "asymmetric_gain", np.abs(u)
    yield "curved_input", u * u
    yield "gain_fade", u * np.linspace(0, 1, len(u))
    for samples in DELAYS:
        yield "input_delay", _after(u, samples)
    for tau in LAGS:
        lagged = _lagged(u, tau)
        yield "actuator_lag", lagged
        for share in SHARES[1::2]:
            yield "inner_saturation", np.minimum(lagged, share * largest)
    for width in (share * largest for share in SHARES):
        yield "dead_zone", np.maximum(u - width, 0) + np.minimum(u + width, 0)
        yield "input_saturation", np.clip(u, -width, width)
        yield "backlash", _followed(u, width / 2, jumps=False)
        yield "valve_stiction", _followed(u, width / 2, jumps=True)
    for share in SHARES[:3]:
        yield "rate_limit", _limited(u, share * step)


@dataclass(frozen=True)
class StateLibrary:
    """Columns that change with the state: x, v of a body, x of a process; its sizes are those of the records."""

    body: bool
    angle: bool
    has_x: bool
    x_size: float
    v_size: float
    low: float
    high: float
    frequency: float  # rad/s, of a disturbance

    def columns(self, x: np.ndarray, v: np.ndarray, u: np.ndarray, t: np.ndarray | float) -> list[Column]:
        """Evaluate all of them; any shapes that broadcast."""
        ones = np.ones(np.broadcast_shapes(x.shape, v.shape))
        found: list[Column] = [("constant_load" if self.body else LINEAR, ones)]
        found += [("periodic_disturbance", wave(self.frequency * t) * ones) for wave in (np.sin, np.cos)]
        if self.has_x:
            found.append((LINEAR, x))
        return found + (self._of_body(x, v, u) if self.body else self._of_process(x, v))

    def _of_process(self, x: np.ndarray, v: np.ndarray) -> list[Column]:
        above = [np.maximum(x - (self.low + share * (self.high - self.low)), 0) for share in (0.5, 0.65, 0.8)]
        return [
            (LINEAR, v), ("sqrt_outflow", np.sqrt(np.maximum(x, 0))), *(("overflow", column) for column in above),
        ]  # fmt: skip

    def _of_body(self, x: np.ndarray, v: np.ndarray, u: np.ndarray) -> list[Column]:
        sign = np.tanh(20 * v / self.v_size)
        found: list[Column] = [(LINEAR, v), ("coulomb_friction", sign), ("quadratic_drag", v * np.abs(v))]
        found += [("stribeck_friction", sign * np.exp(-((v / (s * self.v_size)) ** 2))) for s in (0.1, 0.3)]
        found.append(("load_friction", np.abs(u) * sign))
        if not self.has_x:
            return found
        found += [("quadratic_stiffness", x * x), ("cubic_stiffness", x**3)]
        for share in (0.6, 0.75, 0.9):
            c = share * max(abs(self.low), abs(self.high))
            found.append(("hard_stop", np.maximum(x - c, 0) + np.minimum(x + c, 0)))
        if self.angle:
            found.append(("gravity", np.sin(x)))
        for share in PERIODS:
            phase = 2 * np.pi * x / (share * (self.high - self.low))
            found += [("position_torque", np.sin(phase)), ("position_torque", np.cos(phase))]
        return found


def _after(u: np.ndarray, samples: int) -> np.ndarray:
    return np.concatenate((np.full(samples, u[0]), u[:-samples]))


def _lagged(u: np.ndarray, tau: float) -> np.ndarray:
    keep = np.exp(-1 / tau)
    return u[0] + lfilter([1 - keep], [1, -keep], u - u[0])


def _followed(u: np.ndarray, width: float, jumps: bool) -> np.ndarray:
    """Follow at a distance of `width` (play), or stay until that far off and then go all the way (stiction)."""
    place, places = u[0], np.empty_like(u)
    for k, wanted in enumerate(u):
        if abs(wanted - place) > width:
            place = wanted if jumps else wanted - width * np.sign(wanted - place)
        places[k] = place
    return places


def _limited(u: np.ndarray, most: float) -> np.ndarray:
    """Follow at a rate of at most `most` per sample."""
    place, places = u[0], np.empty_like(u)
    for k, wanted in enumerate(u):
        place += np.clip(wanted - place, -most, most)
        places[k] = place
    return places
