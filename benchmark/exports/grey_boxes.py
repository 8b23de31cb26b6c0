"""Grey boxes as step forms: the laws of their effects, and a step of each plant."""

from __future__ import annotations

import re

import numpy as np
from jaxtyping import Float

from simgap.exports import bodies
from simgap.exports.machines import MachineWriter
from simgap.exports.writers import Cells, PlantWriter
from simgap.greybox.model import FittedPlant, GreyBoxModel
from simgap.step_form import StepForm, source_of


class GreyBoxStep:
    """A grey box as a step form, and its starts."""

    def __init__(self, model: GreyBoxModel, nu: int, ny: int) -> None:
        cells = Cells(0)
        self.writers = [_writer(fitted)(fitted, number, cells, nu) for number, fitted in enumerate(model.plants)]
        laws: dict[str, str] = {"dry_friction": source_of(bodies.dry_friction)}
        shared = (
            bodies.move_body,
            bodies.stop_body,
            bodies.brake_body,
            bodies.flow_out,
            bodies.fill_tanks,
            bodies.spill_tanks,
            bodies.take,
        )
        laws |= {function.__name__: source_of(function) for function in shared}
        for writer in self.writers:
            for name, law, helpers in writer.laws():
                laws |= {helper.__name__: source_of(helper) for helper in helpers}
                laws[name] = source_of(law, name)
        texts = [writer.text() for writer in self.writers]
        calls = "".join(f"    {writer.name}_step(s, u, y)\n" for writer in self.writers)
        step = f'def step(s: list, u: list, y: list):\n    """Fill y(k), and take the state to sample k."""\n{calls}'
        source = "\n\n\n".join(text.strip() for text in [*laws.values(), *texts, step]) + "\n"
        constants = {name: value for writer in self.writers for name, value in writer.constants().items()}
        direct = any(writer.plant.imposed or max(writer.plant.taps) > 0 for writer in self.writers)
        source = _only_used(source)
        constants = {name: value for name, value in constants.items() if re.search(rf"\b{name}\b", source)}
        held = sorted({channel for writer in self.writers for channel in writer.held()})
        self.form = StepForm(source, constants, np.zeros(cells.taken), nu, ny, direct, tuple(held))

    def start(self, u: Float[np.ndarray, "T nu"], y_init: Float[np.ndarray, "n ny"]) -> Float[np.ndarray, " ns"]:
        """Return the state before sample n, from the start that suits the first n samples."""
        state = self.form.rest.copy()
        for writer in self.writers:
            writer.start(u, y_init, state)
        return self.form.run_on(u[: len(y_init)], state)[1]


def _writer(fitted: FittedPlant) -> type[PlantWriter]:
    return PlantWriter if fitted.estimate.plant.machine is None else MachineWriter


def _only_used(source: str) -> str:
    """Leave out the functions that none of the later ones calls."""
    functions = source.split("\n\n\ndef ")
    kept: list[str] = []
    for text in reversed(functions):
        name = text.removeprefix("def ").partition("(")[0]
        if name == "step" or any(f"{name}(" in later for later in kept):
            kept.insert(0, text)
    return "def " + "\n\n\ndef ".join(text.removeprefix("def ") for text in kept)
