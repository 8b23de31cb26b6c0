"""What is known of a machine before it is identified: its constants, and the controller inside it."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Known:
    """A constant in SI units: a number, an interval where it is doubted, or an input column times `factor`."""

    value: float = math.nan
    low: float = 0.0
    high: float = math.inf
    column: str = ""
    factor: float = 1.0

    @property
    def certain(self) -> bool:
        """Whether it is a number that nobody doubts."""
        return not self.column and self.low == self.high


@dataclass(frozen=True)
class KnownPlant:
    """A driven body of one coordinate q, or of one velocity or level, in SI units:

        J q'' = k V e c - (d + b e) q' - m g l sin(q - q0) - forces,   J = J0 + m l^2, or J0 + m without an arm
        c = K (r - q) - D q' with a controller inside, else the input itself

    V the supply, e whether the drive is enabled, K the gain. What is None is to be found, or is not there.
    """

    input: str  # the column of the goal r, or of the drive
    controlled: bool = False
    gain: Known | None = None
    derivative: Known | None = None
    differentiates: bool = False  # the controller is a PD
    supply: Known | None = None
    enabled: str = ""
    mass: Known | None = None
    arm: Known | None = None
    inertia: Known | None = None
    damping: Known | None = None
    gravity: float = 0.0  # m/s^2; 0 where it does not act
    hangs_at: float = 0.0  # unit of the output
    radian: float = 1.0  # rad (or m) in a unit of the output
    goal_factor: float = 1.0  # units of the output in a unit of the goal
