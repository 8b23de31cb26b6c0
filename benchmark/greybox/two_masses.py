"""A drive of two masses with a flexible joint between them: the motor, on which inputs and forces act, and the load.

    x'' = b u + forces - d x' - k x - p ((x - q) + c (x' - q')),   q'' = r ((x - q) + c (x' - q'))

z = (x, x', q, q'), p and r in 1/s^2, c in s (Spong, Modeling and control of elastic joint robots, 1987).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np
from jaxtyping import Float

Side = Literal["", "motor", "load"]  # that is measured; none where there is no joint
MEASURED: dict[Side, int] = {"": 0, "motor": 0, "load": 2}
WIDTH = 5  # parameters (d, k, p, r, c)
POWERS = (1, 2, 2, 2, 1)  # of 1/s, of their largest values; a joint is more damped than it swings long before
ENTRY = 1  # the state that forces change
DAMPED = 0.2  # damping ratio; shafts, belts and gear teeth lose less in a cycle


def matrix(theta: Float[np.ndarray, " 5"]) -> Float[np.ndarray, "4 4"]:
    """Return A of z' = A z + (inputs and forces)."""
    d, k, p, r, c = theta
    return np.array([
        [0.0, 1.0, 0.0, 0.0], [-k - p, -d - p * c, p, p * c],
        [0.0, 0.0, 0.0, 1.0], [r, r * c, -r, -r * c],
    ])  # fmt: skip


def shapes(rigid: Float[np.ndarray, " 2"], duration: float, dt: float) -> Iterator[list[float]]:
    """List parameters that turn a rigid drive, x'' + d x' + k x = b u, into one that swings as fast as can be seen."""
    for swing in np.geomspace(6 / duration, 2.5 / dt, 10):
        for share in (0.2, 0.7):  # of the load in the whole inertia
            both = rigid / (1 - share)
            yield [both[0], both[1], share * swing**2, (1 - share) * swing**2, 0.06 / swing]


def natural_sizes(theta: Float[np.ndarray, " 5"], slowest: float) -> Float[np.ndarray, " 5"]:
    """Return what would be the sizes of parameters that are near zero: rates of the motion, 1/s or 1/s^2."""
    d, k, p, r, _ = theta
    swing = max(slowest, np.sqrt(p + r))
    rate = max(slowest, d, np.sqrt(k))
    return np.array([rate, rate * rate, swing * swing, swing * swing, 1 / swing])


def swings(theta: Float[np.ndarray, " 5"], duration: float, dt: float) -> bool:
    """Tell whether the joint swings, and no faster or slower than records can show."""
    _, _, p, r, c = theta
    swing = np.sqrt(p + r)
    return bool(2 / duration < swing < np.pi / dt and 0.5 * c * swing < DAMPED and min(p, r) > 0)
