"""What a diagnosis found about somebody's simulation as a whole: records beside those of `simgap.findings`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

# How a simulation holds an effect of the machine, or one that the machine does not have.
Holds = Literal["missing", "other size", "not in the machine"]


@dataclass(frozen=True)
class LinearNumber:
    """One number of a linear part: of the machine, with its 95 % interval, and of the simulation."""

    name: str
    unit: str
    value: float
    low: float
    high: float
    simulated: float


@dataclass(frozen=True)
class TheirSimulation:
    """Errors and linear part of somebody's simulation.

    errors: of each output, {"train": {"rmse": .., "mae": ..}, "test": ..} in its unit; linear: the numbers of its
    linear part beside those of the machine; linear_share: the squared error that they make by themselves, as a share of
    the simulation's in training; linear_differs: whether that is more than chance and worth a word; unlike: the share
    of the simulation's variance that no model here repeats.
    """

    errors: dict[str, dict[str, dict[str, float]]]
    linear: tuple[LinearNumber, ...] = ()
    linear_share: float = 0.0
    linear_differs: bool = False
    unlike: float = 0.0

    def to_json(self) -> dict[str, Any]:
        """Return what stands under "simulation" in the answer."""
        return vars(self) | {"linear": [vars(number) for number in self.linear]}
