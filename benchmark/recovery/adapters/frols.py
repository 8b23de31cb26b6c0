"""Polynomial NARX: what the products that forward regression keeps say of the cause."""

from __future__ import annotations

from typing import Any

import numpy as np

from simgap.records import Dataset
from simgap.registry import ADAPTERS, MODELS

# What a product may stand for, by the kind of the output and by what is multiplied, the likeliest first. Polynomials
# know no sign and no size |y|: the cubic term has to stand for both.
OF_OUTPUT = {
    ("position", 2): ["quadratic_stiffness", "curved_sensor", "absolute_sensor"],
    ("position", 3): ["cubic_stiffness", "hard_stop", "gravity", "coulomb_friction", "quadratic_drag",
                      "position_torque", "hysteresis", "sensor_saturation"],
    ("velocity", 2): ["curved_sensor", "absolute_sensor"],
    ("velocity", 3): ["coulomb_friction", "quadratic_drag", "stribeck_friction", "hysteresis", "sensor_saturation"],
    ("level", 2): ["sqrt_outflow", "overflow", "curved_sensor"],
    ("level", 3): ["sqrt_outflow", "overflow", "sensor_saturation"],
}  # fmt: skip
OF_INPUT = {
    2: ["curved_input", "asymmetric_gain", "inner_saturation"],
    3: ["dead_zone", "input_saturation", "backlash", "valve_stiction", "rate_limit"],
}
OF_BOTH = ["load_friction"]


@ADAPTERS.register("frols")
def answer(dataset: Dataset) -> dict[str, list[list[str]]]:
    """Name what the terms of a polynomial NARX stand for, in the order in which FROLS chose them (Billings 2013).

    Every square or cube of outputs, of inputs or of both is one cause, with all the effects that it may stand for; an
    input that acts only after two samples or more is a delay.
    """
    model: Any = MODELS["narx"]()
    model.fit(dataset.training, 0)
    found, ny = model.model, len(dataset.channels.outputs)
    kind = dataset.channels.outputs[0].kind
    causes = []
    for term in found.terms[found.owner == 0]:
        of_y = int(np.count_nonzero((term > 0) & (term <= ny * found.lags)))
        of_u = int(np.count_nonzero(term > ny * found.lags))
        if of_y + of_u < 2:
            continue
        named = OF_OUTPUT.get((kind if kind != "other" else "level", of_y + of_u), []) if of_y else []
        named = named + (OF_INPUT[of_u + of_y] if of_u else []) + (OF_BOTH if of_y and of_u else [])
        if named not in causes:
            causes.append(named)
    of_input = found.terms[(found.owner[:, None] == 0) & (found.terms > ny * found.lags)] - ny * found.lags - 1
    if len(of_input) and of_input.min() // len(dataset.channels.inputs) + found.nk > 1:
        causes.append(["input_delay"])
    return {"names": causes}
