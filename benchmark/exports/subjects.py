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
from simgap.greybox.model import GreyBoxModel
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
    plant: Mapping[str, float] = field(default_factory=dict)  # what is known of the machine: inertia, torque_constant

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


def friction_record(model: Any, about: FittedOn, largest: Float[np.ndarray, " nu"]) -> CheckRecord | None:
    """Make a record from rest that reverses, and then holds below breakaway; None for a model without dry friction."""
    if not isinstance(model, GreyBoxModel):
        return None
    breakaway = [_breakaway(fitted) for fitted in model.plants]
    if not any(breakaway):
        return None
    hold = 0.5 * min(filter(None, breakaway))
    top = max(float(largest[0]), 4 * hold)
    corners = (0.0, top, 0.0, -top, 0.0, hold, hold, -hold, -hold, 0.0)
    u = np.zeros((RAMP * (len(corners) - 1), len(largest)))
    u[:, 0] = np.interp(np.arange(len(u)) / RAMP, range(len(corners)), corners)
    y_hat = np.empty((len(u), len(about.channels.outputs)))
    for fitted in model.plants:
        plant = fitted.forecasting
        run = Simulator(plant, u[None]).run(fitted.estimate.theta, np.zeros((1, plant.n_local)))
        y_hat[:, list(fitted.outputs)] = run[0]
    form, _ = step_of("greybox", model, about)
    return CheckRecord("reversal", u, y_hat[:0], y_hat, form.rest)


def _breakaway(fitted: Any) -> float:
    """Return the size of the first input that dry friction just holds at rest; 0 where there is none."""
    plant, theta = fitted.forecasting, fitted.estimate.theta
    gain = abs(float(np.sum(theta[plant.layout.gains].reshape(plant.nu, -1)[0])))
    frictions = [term for term in plant.on("force") if term.effect.role == "friction"]
    if plant.imposed or not frictions or not gain:
        return 0.0
    nothing = np.zeros(4)
    holds = [
        term.effect.term(0.0, 0.0, 0.0, plant.dt, theta, plant.part_of(term).start, nothing, 0) for term in frictions
    ]
    return float(sum(holds)) / gain


def ranges(experiments: Sequence[Experiment]) -> tuple[Float[np.ndarray, "2 nu"], Float[np.ndarray, "2 ny"]]:
    """Measure the least and the largest value of each input and output."""
    signals = [np.concatenate([getattr(x, name) for x in experiments]) for name in ("u", "y")]
    u, y = (np.stack([signal.min(axis=0), signal.max(axis=0)]) for signal in signals)
    return u, y
