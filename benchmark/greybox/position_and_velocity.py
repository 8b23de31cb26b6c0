"""Two outputs that are a position and its velocity, seen from the readings alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.signal import detrend

from simgap.records import Channels, Kind, TrainingSet
from simgap.units import of_motion

# Share of a position that the integral of its velocity explains at least, with what noise and sensors add to both;
# and where it is known what each is, but not whether both are of one body.
INTEGRAL, OF_ONE_BODY = 0.8, 0.5
# Share of the rest that a leak of the position explains at most; else it follows the other signal with a lag.
LEAK = 0.5
FAR = 5.0  # standard deviations: a rest that is larger is a bad reading


def with_kind(channels: Channels, output: int, kind: Kind) -> Channels:
    """Say of one output what the records show it to be."""
    outputs = list(channels.outputs)
    outputs[output] = replace(outputs[output], kind=kind, kind_from="evidence")
    return replace(channels, outputs=tuple(outputs))


def with_velocity(data: TrainingSet) -> Channels:
    """Name two outputs that are a position and its velocity, where nobody says it of one of them or of both."""
    channels = data.channels
    known = [None if c.kind_from == "unknown" else c.kind for c in channels.outputs]
    free = {i: "position" not in known or kind == "position" for i, kind in enumerate(known)}
    possible = [
        (i, j) for i, of_i in enumerate(known) for j, of_j in enumerate(known)
        if i != j and None in (of_i, of_j) and of_i in (None, "position") and of_j in (None, "velocity") and free[i]
    ]  # fmt: skip
    shares = {pair: integral_share(data, *pair) for pair in possible}
    best = max(possible, key=lambda pair: shares[pair], default=None)
    if best is None or shares[best] < INTEGRAL:
        return channels
    for output, kind in zip(best, ("position", "velocity"), strict=True):
        if known[output] is None:
            channels = with_kind(channels, output, kind)
    return channels


def integral_share(data: TrainingSet, position: int, velocity: int, lags: bool = False) -> float:
    """Compute the share of x that its velocity explains; zero where the two are no such pair.

        x = x0 + b t + g int v dt,   g > 0

    The trend b is the offset of a sensor, g a matter of units; a sine is its own second derivative, but with g < 0. A
    signal behind a lag, x' = g v - a x, asks for the integral of x too, and is no position unless it `lags` for sure.
    """
    signals = [
        np.stack([detrend(x.y[:, position]), detrend(_integral(x.y[:, velocity], x.dt)),
                  detrend(_integral(x.y[:, position], x.dt))])
        for x in data.train if len(x) > 2
    ]  # fmt: skip
    if not signals:
        return 0.0
    x, of_v, of_x = np.concatenate(signals, axis=1)
    rest, gains = _regress(x, of_v[:, None])
    good = np.abs(rest) <= FAR * 1.4826 * np.median(np.abs(rest))
    x, of_v, of_x = x[good], of_v[good], of_x[good]
    if len(x) < FAR or not x.any():
        return 0.0
    rest, gains = _regress(x, of_v[:, None])
    behind_lag, _ = _regress(x, np.stack((of_v, of_x), axis=1))
    leaks = rest @ rest - behind_lag @ behind_lag > LEAK * (rest @ rest)
    return (
        0.0
        if gains[0] <= 0 or (not lags and leaks and rest @ rest > 1e-6 * (x @ x))
        else float(1 - rest @ rest / (x @ x))
    )


def _integral(v: Float[np.ndarray, " N"], dt: float) -> Float[np.ndarray, " N"]:
    return np.concatenate(([0.0], np.cumsum(0.5 * (v[1:] + v[:-1])))) * dt


def _regress(
    y: Float[np.ndarray, " N"], features: Float[np.ndarray, "N m"]
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " m"]]:
    gains = np.linalg.lstsq(features, y, rcond=None)[0]
    return y - features @ gains, gains


def plants_of(data: TrainingSet, channels: Channels) -> list[tuple[int, ...]]:
    """List the outputs of each plant: the only position with the only velocity, if that is its own; else each alone.

    That it is, their units say, or else the readings.
    """
    kinds = [channel.kind for channel in channels.outputs]
    pair = tuple(kinds.index(kind) for kind in ("position", "velocity") if kinds.count(kind) == 1)
    if len(pair) == 2 and (
        _same_motion(*(channels.outputs[i].unit for i in pair)) or integral_share(data, *pair, lags=True) >= OF_ONE_BODY
    ):
        return [pair] + [(i,) for i in range(len(kinds)) if i not in pair]
    return [(i,) for i in range(len(kinds))]


def _same_motion(position: str, velocity: str) -> bool:
    """Tell whether both are units of lengths, or both of angles."""
    return of_motion(position).kind == of_motion(velocity).kind != ""
