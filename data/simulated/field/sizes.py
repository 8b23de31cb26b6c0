"""How large each effect is on a machine: in proportion to the signals that it has without it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from simgap.data.simulated.field.kernels import Actuator, Machine
from simgap.data.simulated.field.machines import RIGS, Plant

ANGLES = ((0.0, 0.05), (0.25, 0.8), (0.5, 1.2), (1.0, 2.0))  # rad, that a pendulum reaches by strength


def suitable(rig: str, outside: bool = False) -> tuple[str, ...]:
    """List the effects that make sense on a machine; none of them is outside of the catalogue."""
    return () if outside else RIGS[rig].effects


def largest_angle(strength: float) -> float:
    """Return how far a pendulum swings, rad."""
    strengths, angles = zip(*ANGLES, strict=True)
    return float(np.interp(strength, strengths, angles))


def apply(
    plant: Plant, effects: Mapping[str, float], u: np.ndarray, y: np.ndarray, channel: int, jump: float
) -> tuple[Machine, Actuator, float]:
    """Give the machine and the actuator with the effects in them, and the size of the slow disturbance.

    u [N] is the input on whose `channel` they act and y [N] the output, both without any effect.
    """
    machine, gain = plant.machine, abs(plant.machine.gain2 if channel else plant.machine.gain)
    spread, force = float(np.std(u)), gain * float(np.std(u))
    s = dict.fromkeys(
        ("constant_load", "coulomb_friction", "cubic_stiffness", "input_delay", "dead_zone", "backlash",
         "valve_stiction", "load_drift"), 0.0,
    ) | dict(effects)  # fmt: skip
    machine = machine._replace(
        load=0.6 * s["constant_load"] * force,
        coulomb=0.5 * s["coulomb_friction"] * force,
        stiffness3=0.3 * s["cubic_stiffness"] * force / float(np.std(y)) ** 3,
    )
    limit = np.inf
    if strength := effects.get("input_saturation", 0.0):
        limit = float(np.quantile(np.abs(u), 1 - 0.4 * strength))
    stick = 1.5 * s["valve_stiction"] * spread
    delay = 0.4 * s["input_delay"] * plant.slowest
    gap = 1.5 * s["backlash"] * spread
    actuator = Actuator(channel, delay, 0.6 * s["dead_zone"] * spread, limit, gap, stick, jump * stick)
    return machine, actuator, 0.7 * s["load_drift"] * force
