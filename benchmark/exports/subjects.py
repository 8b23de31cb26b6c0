"""What is exported: a fitted model, its step, and the records with the answers that are expected of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.exports.grey_boxes import GreyBoxStep
from simgap.exports.rests import GreyBoxWithRest
from simgap.greybox.model import FittedPlant, GreyBoxModel
from simgap.greybox.simulation import Simulator
from simgap.protocol import is_stochastic
from simgap.records import Experiment, UnusableInput
from simgap.saved.archive import FittedOn
from simgap.step_form import StepForm

# Root mean square of the difference over the standard deviation: computing models, and networks.
LIMITS = (1e-6, 1e-4)
NO_STEP = "such a model cannot be written as a step from sample to sample"
RAMP = 60  # samples of each part of the record that reverses and holds


@dataclass(frozen=True, eq=False)
class CheckRecord:
    """Inputs of T samples and what our free run makes of them: rows n .. T-1, from n measured samples.

    `start` is the state of the step before row n, empty where the model has no step.
    """

    name: str
    u: Float[np.ndarray, "T nu"]
    y_init: Float[np.ndarray, "n ny"]
    y_hat: Float[np.ndarray, "N ny"]
    start: Float[np.ndarray, " ns"]

    @property
    def n(self) -> int:
        """The first row that is simulated."""
        return len(self.y_init)

    def difference(self, y: Float[np.ndarray, "N ny"]) -> float:
        """Compute the largest RMS difference of an output over its standard deviation, or its size if it stands."""
        if y.shape != self.y_hat.shape:
            return float("inf")
        moves, size = np.std(self.y_hat, axis=0), np.max(np.abs(self.y_hat), axis=0)
        scale = np.where(moves > 1e-12 * size, moves, np.where(size > 0, size, 1.0))
        difference = float(np.max(np.sqrt(np.mean((y - self.y_hat) ** 2, axis=0)) / scale))
        return difference if np.isfinite(difference) else float("inf")


@dataclass(frozen=True, eq=False)
class Subject:
    """A fitted model on its way out."""

    name: str
    model: Any
    fitted_on: FittedOn
    records: tuple[CheckRecord, ...]
    input_range: Float[np.ndarray, "2 nu"]  # the least and the largest value of each input
    output_range: Float[np.ndarray, "2 ny"]
    known: Mapping[str, float] = field(default_factory=dict)  # of a linear plant: inertia, torque_constant

    @cached_property
    def form(self) -> StepForm:
        """The model as one step. Raises UnusableInput where it has none."""
        return step_of(self.name, self.model, self.fitted_on)[0]

    @property
    def limit(self) -> float:
        """The largest difference that passes as the same free run."""
        return LIMITS[is_stochastic(self.model)]


def step_of(name: str, model: Any, about: FittedOn) -> tuple[StepForm, Any]:
    """Give the step form of a model, and the function that finds its start. Raises UnusableInput where it has none."""
    nu, ny = len(about.channels.inputs), len(about.channels.outputs)
    if isinstance(model, GreyBoxModel):
        grey = GreyBoxStep(model, nu, ny)
        return grey.form, grey.start
    if callable(getattr(model, "grey_and_rest", None)):
        inner, rest = model.grey_and_rest()
        whole = GreyBoxWithRest(inner, rest, nu, ny)
        return whole.form, whole.start
    if not has_step(type(model)):
        raise UnusableInput(f"{name}: {NO_STEP}")
    return model.step_form(nu, ny), model.step_start


def has_step(kind: type) -> bool:
    """Tell whether models of a class can be written as a step."""
    offers = (getattr(kind, name, None) for name in ("step_form", "grey_and_rest"))
    return issubclass(kind, GreyBoxModel) or any(map(callable, offers))


def refusal_of_step(kind: type) -> str:
    """Say why a format that needs a step takes no models of this class; empty where it does."""
    return "" if has_step(kind) else NO_STEP


def measured_record(name: str, model: Any, about: FittedOn, x: Experiment) -> CheckRecord:
    """Take the free run over a measured record."""
    y_init = x.y[: about.n_init]
    y_hat = model.simulate(x.u[None], y_init[None])[0]
    if not np.isfinite(y_hat).all():
        raise UnusableInput(
            f"the free run of {name} over {x.name} grows without bound; there is nothing to compare with"
        )
    start = step_of(name, model, about)[1](x.u, y_init) if has_step(type(model)) else np.zeros(0)
    return CheckRecord("record", x.u, y_init, y_hat, start)


def friction_record(
    model: Any, about: FittedOn, largest: Float[np.ndarray, " nu"], x: Experiment
) -> CheckRecord | None:
    """Make a record from rest that reverses, and then holds below breakaway; None for a model without dry friction.

    A known machine has the columns that x has in the middle, and is enabled.
    """
    if not isinstance(model, GreyBoxModel):
        return None
    others = usual_inputs(model, x.u)
    breakaway = [_breakaway(fitted, others) for fitted in model.plants]
    if not any(breakaway):
        return None
    hold = 0.5 * min(filter(None, breakaway))
    machine = model.plants[0].forecast.plant.machine
    driven = machine.of_drive if machine is not None else 0
    top = max(float(largest[driven]), 4 * hold)
    corners = (0.0, top, 0.0, -top, 0.0, hold, hold, -hold, -hold, 0.0)
    u = np.tile(others, (RAMP * (len(corners) - 1), 1))
    u[:, driven] = np.interp(np.arange(len(u)) / RAMP, range(len(corners)), corners)
    y_hat = np.empty((len(u), len(about.channels.outputs)))
    for fitted in model.plants:
        plant = fitted.forecast.plant
        run = Simulator(plant, u[None]).run(fitted.forecast.theta, np.zeros((1, plant.n_local)))
        y_hat[:, list(fitted.outputs)] = run[0]
    form, _ = step_of("greybox", model, about)
    return CheckRecord("reversal", u, y_hat[:0], y_hat, form.rest)


def usual_inputs(model: GreyBoxModel, u: Float[np.ndarray, "T nu"]) -> Float[np.ndarray, " nu"]:
    """Return the inputs beside the one that moves: the middle of a machine's columns, enabled, else zero."""
    machine = model.plants[0].forecast.plant.machine
    if machine is None:
        return np.zeros(u.shape[1])
    usual = np.median(u, axis=0)
    if machine.known.enabled:
        usual[machine.names.index(machine.known.enabled)] = 1.0
    return usual


def _breakaway(fitted: FittedPlant, others: Float[np.ndarray, " nu"]) -> float:
    """Return the size of the first input, or of a goal, that dry friction just holds at rest; 0 without friction."""
    plant, theta = fitted.forecast.plant, fitted.forecast.theta
    frictions = [term for term in plant.on("force") if term.effect.role == "friction"]
    if plant.imposed or not frictions:
        return 0.0
    gain = abs(float(np.sum(theta[plant.layout.gains].reshape(-1, len(plant.taps))[0])))
    if (machine := plant.machine) is not None:
        known, row = machine.known, others[None, None]
        gain *= machine.column(row, known.supply, 1.0)[0, 0]
        gain *= machine.column(row, known.gain, 1.0)[0, 0] * known.goal_factor if machine.controlled else 1.0
    nothing = np.zeros(4)
    effects: list[tuple[Any, int]] = [(term.effect, plant.part_of(term).start) for term in frictions]
    holds = [effect.term(0.0, 0.0, 0.0, plant.dt, theta, at, nothing, 0) for effect, at in effects]
    return float(sum(holds)) / gain if gain else 0.0


def ranges(experiments: Sequence[Experiment]) -> tuple[Float[np.ndarray, "2 nu"], Float[np.ndarray, "2 ny"]]:
    """Measure the least and the largest value of each input and output."""
    signals = [np.concatenate([getattr(x, name) for x in experiments]) for name in ("u", "y")]
    u, y = (np.stack([signal.min(axis=0), signal.max(axis=0)]) for signal in signals)
    return u, y
