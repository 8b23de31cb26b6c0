"""What the numbers of a linear part are called in an answer."""

from __future__ import annotations

from collections.abc import Sequence

from simgap.greybox.machine import NAMES
from simgap.greybox.plant import Plant


def linear_names(plant: Plant, inputs: Sequence[str]) -> list[tuple[str, str]]:
    """Name each number of theta before those of the terms, with its unit where one can be told; inputs by name."""
    of_poles, of_gains, taps = plant.layout.poles, plant.layout.gains, len(plant.taps)
    if plant.machine is not None:
        poles = [(name.replace("_", " "), "") for name in NAMES]
        inputs, taps = [plant.machine.known.input], 1
    elif plant.joint or plant.order > 2 or plant.cascade:
        poles = [(parameter.name, "") for parameter in plant.parameters[of_poles]]
    elif (plant.kind, plant.order) in (("position", 2), ("velocity", 1)):
        poles = [("damping over inertia", "1/s"), ("stiffness over inertia", "1/s^2")][: plant.order]
    else:
        poles = [("1 / time constant", "1/s")] if plant.order == 1 else [("a0", "1/s"), ("a1", "1/s^2")][: plant.order]
    taken = [f", tap {i + 1}" if taps > 1 else "" for i in range(taps)]
    gains = [(f"gain of {name}{tap}", "") for name in inputs for tap in taken]
    rest = ["offset" if p.name == "d" else p.name for p in plant.parameters[of_gains.stop : plant.n_linear]]
    return [*poles, *gains, *((name, "") for name in rest)]
