"""Features of inputs and simulated outputs that the rest of an error is regressed on; no measured output enters."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.signal import lfilter

from simgap.greybox import dynamics
from simgap.greybox.plant import Plant

SHAPES_AT_A_TIME = 25  # so that the features of a long record need not all fit into memory
FAR = 8.0  # spreads: a signal farther out counts as no farther


@dataclass(frozen=True)
class Design:
    """How many shapes, how wide in spreads of the signals, and how much of the past they see.

    lags: earlier samples beside the present one; before: time constants, in samples, of running means of the signals;
    after: those of running means of the shapes.
    """

    shapes: int
    width: float
    lags: tuple[int, ...] = ()
    before: tuple[float, ...] = ()
    after: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class Features:
    """The signals z and shapes cos(w z + b) of them, each as it is and through the poles of the plant.

    z: inputs, simulated outputs and their changes in units of their spread in training, at all that the design sees.
    denominator: 1 + a1 q^-1 + .. of the plant.
    """

    design: Design
    means: Float[np.ndarray, " s"]
    sizes: Float[np.ndarray, " s"]
    denominator: Float[np.ndarray, " m"]
    w: Float[np.ndarray, "n shapes"]
    b: Float[np.ndarray, " shapes"]

    @classmethod
    def draw(
        cls,
        design: Design,
        u: Float[np.ndarray, "E T nu"],
        y_hat: Float[np.ndarray, "E T ny"],
        mask: Bool[np.ndarray, "E T"],
        denominator: Float[np.ndarray, " m"],
        seed: int,
    ) -> Features:
        """Measure the signals of training records and draw the shapes of a Gaussian kernel of the design's width."""
        z = _signals(u, y_hat)[mask]
        spread, rng, lags = z.std(axis=0), np.random.default_rng(seed), 1 + len(design.lags)
        n = z.shape[1] * (lags + len(design.before))
        w = rng.standard_normal((n, design.shapes)) / (design.width * np.sqrt(lags))
        b = rng.uniform(0, 2 * np.pi, design.shapes)
        return cls(design, z.mean(axis=0), np.where(spread > 0, spread, 1.0), denominator, w, b)

    def blocks(
        self, u: Float[np.ndarray, "B T nu"], y_hat: Float[np.ndarray, "B T ny"]
    ) -> Iterator[Float[np.ndarray, "B T f"]]:
        """Compute the features, some columns at a time."""
        with np.errstate(over="ignore", invalid="ignore"):  # of a simulation that grows without bound
            z = (_signals(u, y_hat) - self.means) / self.sizes
        z = np.clip(np.nan_to_num(z), -FAR, FAR)
        past = [_earlier(z, lag) for lag in self.design.lags] + [_mean(z, samples) for samples in self.design.before]
        z = np.concatenate([z, *past], axis=2)
        yield from self._passed_on(z)
        for first in range(0, len(self.b), SHAPES_AT_A_TIME):
            some = slice(first, first + SHAPES_AT_A_TIME)
            yield from self._passed_on(np.cos(z @ self.w[:, some] + self.b[some]))

    def _passed_on(self, phi: Float[np.ndarray, "B T k"]) -> Iterator[Float[np.ndarray, "B T k"]]:
        yield phi
        yield _earlier(phi, 1)
        order = len(self.denominator) - 1
        if order:
            passed = np.asarray(lfilter([1.0], self.denominator, phi, axis=1))
            yield from (_earlier(passed, lag) for lag in range(1, order + 1))
        yield from (_mean(phi, samples) for samples in self.design.after)


def denominator_of(plant: Plant, theta: Float[np.ndarray, " p"], samples: int) -> Float[np.ndarray, " m"]:
    """Compute 1 + a1 q^-1 + .. with the poles of a plant; one that integrates forgets over so many samples."""
    if plant.imposed:
        return np.ones(1)
    poles = np.exp(dynamics.poles(plant, theta) * plant.dt)
    slowest = np.exp(-1.0 / samples)
    return np.real(np.poly(poles * np.minimum(1.0, slowest / np.maximum(np.abs(poles), slowest / 2))))


def _signals(u: np.ndarray, y_hat: np.ndarray) -> Float[np.ndarray, "B T s"]:
    with np.errstate(over="ignore", invalid="ignore"):
        return np.concatenate((u, y_hat, np.diff(y_hat, axis=1, prepend=y_hat[:, :1])), axis=2)


def _earlier(z: Float[np.ndarray, "B T s"], lag: int) -> Float[np.ndarray, "B T s"]:
    """Return the signals so many samples earlier; before the record they stood still."""
    lag = min(lag, z.shape[1])
    return np.concatenate((np.repeat(z[:, :1], lag, axis=1), z[:, : z.shape[1] - lag]), axis=1)


def _mean(z: Float[np.ndarray, "B T s"], samples: float) -> Float[np.ndarray, "B T s"]:
    """Compute running means with that time constant; before the record the signals stood still."""
    q = np.exp(-1.0 / samples)
    return z[:, :1] + lfilter([1 - q], [1.0, -q], z - z[:, :1], axis=1)
