"""The effects that can be hidden in a rig, and how large each is on which rig."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import NamedTuple

from simgap.data.simulated.rigs.plants import RIGS


class Hidden(NamedTuple):
    """The size of an effect at strength 1 on each rig, None where it makes no sense; `field` is where it acts."""

    field: str
    unit: str  # U: of the input, Y: of the first output, L: of length or level
    cart: float | None
    stage: float | None
    slide: float | None
    tank: float | None
    tanks: float | None
    arm: float | None = None
    servo: float | None = None
    supply: float | None = None


CATALOGUE = {
    "dead_zone": Hidden("dead_zone", "U, each way", 1.0, 1.2, 1.2, 2.0, 2.0, 0.7, None, 1.2),
    "input_saturation": Hidden("limit", "U, each way", 1.2, 1.5, 1.5, 4.5, 4.5, None, None, 1.5),
    "asymmetric_gain": Hidden("asymmetry", "share", 0.4, 0.4, 0.4, None, None, None, None, 0.4),
    "curved_input": Hidden("squared", "share that acts by its square", 1.0, 1.0, 1.0, 1.0, 1.0, None, None, 1.0),
    "rate_limit": Hidden("rate", "U/s upwards, half of it downwards", 3.5, 10.0, 4.0, 0.12, 0.06),
    "backlash": Hidden("gap", "U, whole gap", 1.6, 2.0, 2.0, 2.0, 2.0),
    "valve_stiction": Hidden("stick", "U, stick band", 2.0, 2.5, 2.5, 2.5, 2.5),
    "input_delay": Hidden("delay", "s", 0.4, 0.1, 0.3, 12.0, 24.0, 0.12, None, 0.0002),
    "actuator_lag": Hidden("lag", "s", 0.5, 0.1, 0.4, None, None),
    "inner_saturation": Hidden("inner_limit", "U, upwards, behind a lag", 0.8, 1.0, 1.0, 4.0, 4.0),
    "torque_foldback": Hidden("fold", "Y, error of the controller", None, None, None, None, None, None, 0.15),
    "gain_fade": Hidden("fade", "share lost at the end", 0.7, 0.7, 0.7, 0.2, 0.2),
    "constant_load": Hidden("load", "L/s^2", 0.5, 50.0, 7.0, None, None),
    "load_drift": Hidden("load_slope", "L/s^3, tanks L/s^2, standard deviation", 0.032, 5.0, 0.3, 8e-5, 5.6e-5, 0.25),
    "coulomb_friction": Hidden("coulomb", "L/s^2", 0.6, 50.0, 10.0, None, None, 3.0, 20.0),
    "stribeck_friction": Hidden("stribeck", "L/s^2 at high speed", 0.4, 40.0, 8.0, None, None),
    "load_friction": Hidden("load_share", "share of the load", 0.3, 0.3, 0.3, None, None),
    "quadratic_drag": Hidden("drag", "1/L", 1.5, 0.3, 0.2, None, None),
    "quadratic_stiffness": Hidden("stiffness2", "1/(L s^2)", None, 0.45, 0.02, None, None),
    "cubic_stiffness": Hidden("stiffness3", "1/(L^2 s^2)", None, 0.3, 0.01, None, None),
    "gravity": Hidden("gravity", "L/s^2", None, None, None, None, None, 20.0),
    "position_torque": Hidden("position_force", "L/s^2", None, 60.0, 12.0, None, None),
    "periodic_disturbance": Hidden("periodic", "L/s^2", 0.8, 50.0, 10.0, 0.06, 0.06),
    "hysteresis": Hidden("hysteresis", "L/s^2 at saturation", 0.6, 50.0, 10.0, None, None),
    "hard_stop": Hidden("stop", "L, each way", None, 4.0, 7.0, None, None, 1.0),
    "limited_braking": Hidden("coast", "Y/s back to zero", 0.8, None, None, None, None, None, None, 6e3),
    "sqrt_outflow": Hidden("root", "share", None, None, None, 1.0, 1.0),
    "overflow": Hidden("rim", "L", None, None, None, 11.0, 11.0),
    "sensor_drift": Hidden("drift", "Y/s, standard deviation", 0.02, 0.2, 0.15, 0.0025, 0.002),
    "sensor_bias": Hidden("bias", "Y, standard deviation", 0.3, 2.0, 3.0, 0.9, 1.2),
    "curved_sensor": Hidden(
        "sensor_squared", "share that shows by its square", 0.8, 0.8, 0.8, 0.8, 0.8, None, None, 0.8
    ),
    "sensor_saturation": Hidden("sensor_limit", "Y, each way", 0.5, 4.0, 7.0, 11.0, 11.0, None, None, 8.0),
    "sensor_lag": Hidden("sensor_lag", "s", 0.5, 0.1, 0.4, None, None),
    "absolute_sensor": Hidden("absolute", "", 1.0, 1.0, 1.0, None, None),
    "quantisation": Hidden("step", "Y", 0.6, 4.0, 7.0, 2.5, 3.0, None, None, 8.0),
    "outliers": Hidden("outlier_rate", "share of the samples", 0.02, 0.02, 0.02, 0.02, 0.02, None, None, 0.02),
}
OUTSIDE = {  # no diagnosis knows these by name
    "position_dependent_gain": Hidden("ripple", "share", None, 0.6, 0.6, None, None),
    "negative_damping": Hidden("push", "1/s", None, 5.0, 2.0, None, None),
    "missing_input": Hidden("missing", "L/s^2, tanks L/s, standard deviation", 0.7, 40.0, 12.0, 0.1, 0.1),
}


def suitable(rig: str, outside: bool = False) -> tuple[str, ...]:
    """List the effects that make sense on a rig: those of the catalogue, or those outside of it."""
    return tuple(name for name, row in (OUTSIDE if outside else CATALOGUE).items() if getattr(row, rig) is not None)


def physical(rig: str, effects: Mapping[str, float]) -> dict[str, float]:
    """Turn the strength of each effect into its true size on a rig, in physical units (the tables' column `unit`).

    Sizes grow with the strength s, but a rate falls as strong / s, and a limit comes down from the full range as
    full / (1 + s (full / strong - 1)).
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
        if row.field in {"rate", "coast"}:
            sizes[name] = strong / strength if strength > 0 else inf
        elif row.field in {"limit", "inner_limit", "sensor_limit", "rim", "stop", "fold"}:
            full = RIGS[rig].largest_input if row.field in {"limit", "inner_limit"} else RIGS[rig].reach
            sizes[name] = full / (1 + strength * (full / strong - 1)) if strength > 0 else inf
        elif row.field == "absolute":
            sizes[name] = 1.0
    return sizes
