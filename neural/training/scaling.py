"""Physical units to the range -1 to 1 and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simgap.records import Experiment


@dataclass(frozen=True)
class Scaling:
    """v = (value - middle) / half, so that the training data lie between -1 and 1.

    The variance that MSE and R2 of the paper's table 1 imply, 0.07, is that of data scaled in this way.
    """

    middle: tuple[float, ...]
    half: tuple[float, ...]

    @classmethod
    def of(cls, columns: Sequence[Float[np.ndarray, "_ n"]]) -> Scaling:
        """Take the scaling from the extremes of training data; a column that never moves is only shifted."""
        low = np.min([column.min(axis=0) for column in columns], axis=0)
        high = np.max([column.max(axis=0) for column in columns], axis=0)
        half = np.where(high > low, (high - low) / 2, 1.0)
        return cls(tuple(map(float, (low + high) / 2)), tuple(map(float, half)))

    def inside(self, values: np.ndarray) -> np.ndarray:
        """Convert physical units to -1 .. 1."""
        return (values - np.asarray(self.middle)) / np.asarray(self.half)

    def outside(self, values: np.ndarray) -> np.ndarray:
        """Convert -1 .. 1 to physical units."""
        return values * np.asarray(self.half) + np.asarray(self.middle)


def scalings(experiments: Sequence[Experiment], time: bool) -> tuple[Scaling, Scaling]:
    """Scale the features (voltage, say, and time if wanted) and the outputs."""
    return Scaling.of([features(x.u, x.dt, time) for x in experiments]), Scaling.of([x.y for x in experiments])


def features(u: Float[np.ndarray, "T nu"], dt: float, time: bool) -> Float[np.ndarray, "T F"]:
    """Give the inputs, and before them the time since the start in s if wanted (paper, 3.1)."""
    return np.column_stack((dt * np.arange(len(u)), u)) if time else u
