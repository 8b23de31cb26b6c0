"""Ranges within which a repeat of the experiments would find each parameter, and models drawn from them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.stats import norm

from simgap.exports.grey_boxes import GreyBoxStep
from simgap.exports.subjects import Subject
from simgap.greybox.linear_names import linear_names
from simgap.greybox.model import FittedPlant, GreyBoxModel
from simgap.records import Channels, UnusableInput
from simgap.step_form import StepForm

# A repeat errs as much as the estimate does: their difference has twice its variance. The level is that of a normal
# error; thresholds have wider tails, and all ranges hold nine repeats of ten (tests/exports/test_ranges.py).
OF_A_REPEAT = math.sqrt(2.0)
LEVEL = 0.98
VARIANTS = 32  # models that an export holds besides the fitted one
TRIED = 8 * VARIANTS
FEW, MANY = 1e-6, 400


@dataclass(frozen=True)
class Range:
    """The range of one parameter: `part` is "linear part" or the effect, at `channel` where it sits on one."""

    part: str
    channel: str
    parameter: str
    unit: str
    value: float
    low: float
    high: float


def ranges_of(model: Any, channels: Channels) -> list[Range]:
    """List the ranges of a grey box; none of another model, or where its uncertainty is not known."""
    plants = model.plants if isinstance(model, GreyBoxModel) else []
    return [one for fitted in plants if fitted.uncertainty is not None for one in _of_plant(fitted, channels)]


def to_json(ranges: Sequence[Range]) -> list[dict[str, Any]]:
    """Return what stands under "ranges" in export.json."""
    return [asdict(one) for one in ranges]


def _of_plant(fitted: FittedPlant, channels: Channels) -> Iterator[Range]:
    plant, theta, (low, high) = fitted.estimate.plant, fitted.estimate.theta, ends(fitted)
    inputs, outputs = ([c.name for c in part] for part in (channels.inputs, channels.outputs))
    named = [("linear part", "", *name) for name in linear_names(plant, inputs)]
    for term in plant.terms:
        where = {"input": [*inputs, "controller"], "output": [outputs[i] for i in fitted.outputs]}.get(term.effect.port)
        channel = where[term.channel] if where else ""
        named += [(term.effect.name, channel, p.name, p.unit) for p in plant.common_of(term)]
    rows = list(zip(named, plant.parameters, theta.tolist(), low.tolist(), high.tolist(), strict=True))
    for i in fitted.forecast.plant.places_in(plant):
        (effect, channel, name, unit), parameter, value, least, most = rows[i]
        if not parameter.fixed:
            yield Range(effect, channel, name, unit, value, least, most)


def ends(fitted: FittedPlant) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """Return the ends of the ranges of theta, within its bounds."""
    plant, theta, known = fitted.estimate.plant, fitted.estimate.theta, fitted.uncertainty
    reach = OF_A_REPEAT * known.reach(LEVEL) if known is not None else np.zeros(len(theta))
    return np.maximum(theta - reach, plant.low), np.minimum(theta + reach, plant.high)


def drawn(model: GreyBoxModel, seed: int) -> Iterator[GreyBoxModel]:
    """Draw models without end: theta as a repeat would find it, the correlations of its numbers included."""
    rng = np.random.default_rng(seed)
    while True:
        plants = []
        for fitted in model.plants:
            theta, known = fitted.estimate.theta, fitted.uncertainty
            if known is not None:
                theta = theta + OF_A_REPEAT * rng.multivariate_normal(np.zeros(len(theta)), known.covariance, tol=1e-3)
                theta = np.clip(theta, *ends(fitted))
            plants.append(replace(fitted, estimate=replace(fitted.estimate, theta=theta)))
        yield GreyBoxModel(plants)


def variants(subject: Subject) -> list[dict[str, Float[np.ndarray, " _"]]]:
    """Draw constants for the step of a grey box; none of another model, or where its uncertainty is not known.

    What a drawn delay would change of the text or the state of the step is not drawn.
    """
    model = subject.model
    if not isinstance(model, GreyBoxModel) or all(fitted.uncertainty is None for fitted in model.plants):
        return []
    form, found = subject.form, []
    for _, one in zip(range(TRIED), drawn(model, 0), strict=False):
        other: StepForm = GreyBoxStep(one, form.nu, form.ny).form
        if other.source == form.source and len(other.rest) == len(form.rest):
            found.append(other.constants)
        if len(found) == VARIANTS:
            break
    return found


def spread(subject: Subject, numbers: Callable[[Subject], Mapping[str, float]]) -> dict[str, tuple[float, float]]:
    """Return the ranges of numbers that follow from the model, such as the damping of a joint; of those that vary.

    value +- t sd, the standard deviation over models that are drawn: to first order what the parameters' ranges make.
    """
    model, value = subject.model, dict(numbers(subject))
    found: dict[str, list[float]] = {name: [] for name in value}
    if all(fitted.uncertainty is None for fitted in model.plants):
        return {}
    for _, one in zip(range(MANY), drawn(model, 1), strict=False):
        try:
            made = numbers(replace(subject, model=one))
        except UnusableInput:
            continue
        for name, number in made.items():
            if name in found:
                found[name].append(number)
    beyond = float(norm.ppf(0.5 + LEVEL / 2))
    reach = {name: beyond * float(np.std(values)) for name, values in found.items() if values}
    return {
        name: (value[name] - r if value[name] - r > 0 or value[name] <= 0 else 0.0, value[name] + r)
        for name, r in reach.items() if r > FEW * abs(value[name])
    }  # fmt: skip
