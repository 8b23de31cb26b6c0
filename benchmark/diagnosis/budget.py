"""The error budget: where the plain model's squared error on the test experiments goes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from simgap.cores import on_cores
from simgap.diagnosis import promises
from simgap.diagnosis.gains import SMALLEST_ERROR, free_run
from simgap.diagnosis.promises import Promise
from simgap.diagnosis.repeats import variance_of_repeats
from simgap.findings import Budget
from simgap.greybox.evidence import Evidence
from simgap.greybox.model import FittedPlant, GreyBoxModel
from simgap.greybox.past import Past
from simgap.greybox.rest import learn
from simgap.greybox.samples import sizes_of
from simgap.greybox.terms import Term
from simgap.metrics import is_finite
from simgap.records import Dataset

Runs = Sequence[np.ndarray]  # [N, ny] of each experiment


@np.errstate(over="ignore", invalid="ignore", divide="ignore")  # of a simulation that grows without bound
def budgets(
    promised: Promise | None, plain: GreyBoxModel, dataset: Dataset, before: Runs, seed: int
) -> tuple[Budget, ...]:
    """Divide the mean squared error of the plain model among causes, what is learnable, the floor and the unexplained.

        share of cause i = (mse with causes 1 .. i-1 - mse with causes 1 .. i) / mse of the plain model
        learnable = (mse with all causes - mse with all and the learnt rest) / mse of the plain model, 0 at least

    The floor is the variance between repeated runs, where there are any, and no more than what is left; the
    unexplained is the rest, so that all shares of an output sum to 1. `before` is the plain model's simulation of the
    test experiments; where nothing is promised, or no cause named, the learnable is that of its error.
    """
    named = promised if promised and promised.causes else None
    model, after = (named.model, named.after) if named else (plain, before)
    n, rest = dataset.n_init, learn(model, seed)
    learnt = [
        y_hat + rest.predict(x.u[None], model.simulate_whole(x.u[None], x.y[None, :n], Past.of([x])))[0, n:]
        for x, y_hat in zip(dataset.test, after, strict=True)
    ]
    of_plain, of_named = _mse(dataset, before), _mse(dataset, after)
    learnable = np.maximum(of_named - _mse(dataset, learnt), 0.0) / of_plain
    floor = _floor(model, dataset, after)
    causes: dict[int, dict[str, float]] = {}
    errors: dict[int, dict[str, float]] = {}
    for plant in named.named if named else ():
        runs = [[plant_of.simulate_anew(x, n) for x in dataset.test] for plant_of in _with_ever_more(plant)]
        causes |= _causes(plant, of_plain, dataset, runs)
        errors |= _absolute(plant, dataset, [before, *runs])
    rounding = (SMALLEST_ERROR * sizes_of(np.concatenate([x.y for x in dataset.test]))) ** 2
    divided = tuple(
        _divided(
            channel.name, causes.get(j, {}), float(learnable[j]), None if floor is None else floor[j] / of_plain[j]
        )
        if rounding[j] < of_plain[j] < math.inf
        else _divided(channel.name, causes.get(j, {}), math.nan, None)
        for j, channel in enumerate(dataset.channels.outputs)
    )
    return tuple(replace(one, mean_absolute_errors=errors.get(j, {})) for j, one in enumerate(divided))


def _divided(output: str, causes: dict[str, float], learnable: float, floor: float | None) -> Budget:
    """Leave to the floor what is left at most, and the rest unexplained; no share is known where one is not."""
    left = 1.0 - sum(causes.values()) - learnable
    if not math.isfinite(left):
        return Budget(output, dict.fromkeys(causes, math.nan), math.nan, None, math.nan)
    if floor is not None:
        floor = min(float(floor), left)
    return Budget(output, causes, learnable, floor, left - (floor or 0.0))


def _causes(plant: Evidence, plain: np.ndarray, dataset: Dataset, runs: Sequence[Runs]) -> dict[int, dict[str, float]]:
    """Compute for each output of a plant the share of each of its causes, in the order in which they are listed."""
    outputs = list(plant.identified.plant.outputs)
    keys = _keys(plant)
    errors = [plain[outputs], *(_mse(dataset, of_model, outputs) for of_model in runs)]
    taken = [(a - b) / plain[outputs] for a, b in pairwise(errors)]
    return {
        output: {key: float(share[j]) for key, share in zip(keys, taken, strict=True)}
        for j, output in enumerate(outputs)
    }


def _keys(plant: Evidence) -> list[str]:
    effects = [effect for effect, _ in plant.names]
    return [f"{effect}:{channel}" if effects.count(effect) > 1 else effect for effect, channel in plant.names]


def _absolute(plant: Evidence, dataset: Dataset, runs: Sequence[Runs]) -> dict[int, dict[str, float]]:
    """Compute the mean absolute errors of a known machine, without causes ("") and with ever more of them."""
    if plant.channels.plant is None:
        return {}
    output, n = plant.identified.plant.outputs[0], dataset.n_init
    y = np.concatenate([x.y[n:, output] for x in dataset.test])
    errors = [float(np.mean(np.abs(np.concatenate([r.reshape(len(r), -1)[:, 0] for r in one]) - y))) for one in runs]
    return {output: dict(zip(["", *_keys(plant)], errors, strict=True))}


def _with_ever_more(plant: Evidence) -> list[FittedPlant]:
    """List the plant with its first cause, with the first two, and so on; bad readings come first."""
    outliers = len(plant.selection.baseline.outliers)
    causes = [plant.terms[:count] for count in range(1, len(plant.terms) + 1)]
    return [plant.identified.plain] * outliers + on_cores(partial(_only, plant), causes)


def _only(plant: Evidence, terms: Sequence[Term]) -> FittedPlant:
    return promises.only(plant, terms).identified.plant


def _mse(dataset: Dataset, runs: Runs, outputs: Sequence[int] | slice = slice(None)) -> Float[np.ndarray, " ny"]:
    """Compute the mean squared errors of simulations of the test experiments; infinite where one diverges."""
    y = np.concatenate([x.y[dataset.n_init :, outputs] for x in dataset.test])
    y_hat = np.concatenate(runs)
    finite = [is_finite(y_hat[:, j]) for j in range(y.shape[1])]
    return np.mean((y - np.where(finite, y_hat, np.inf)) ** 2, axis=0)


def _floor(model: GreyBoxModel, dataset: Dataset, after: Runs) -> Float[np.ndarray, " ny"] | None:
    """Find the variance between repeated test experiments or, without any, between repeated training experiments."""
    n = dataset.n_init
    errors = [x.y[n:] - y_hat for x, y_hat in zip(dataset.test, after, strict=True)]
    floor = variance_of_repeats(dataset.test, errors, n)
    if floor is None:
        known = [x for x in (*dataset.training.train, *dataset.training.valid) if len(x) > n]
        floor = variance_of_repeats(known, [x.y[n:] - free_run(model, x, n) for x in known], n) if known else None
    return floor
