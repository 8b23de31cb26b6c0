"""One model on one data set: build, fit, score."""

from __future__ import annotations

import inspect
import json
import math
import time
import traceback
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.metrics import failed_metrics, free_run_nrmse
from simgap.protocol import Model, as_chosen, earlier_seconds, is_stochastic
from simgap.records import Dataset, Result, TrainingSet, UnusableInput
from simgap.registry import MODELS, file_of, load_class
from simgap.results.store import plain
from simgap.running.annotations import fits, hints_of, in_words
from simgap.running.provenance import provenance
from simgap.running.workers import threads_in_force
from simgap.tasks import TASKS, USUAL, Evaluation, Task

# Characters of what a fit says that it chose, and of a message, in a line of results.
LARGEST_FITTED = 1 << 20
LONGEST_MESSAGE = 1000


class ModelFault(Exception):
    """A model broke the protocol; the message says how."""


@dataclass(frozen=True)
class Fit:
    """A fitted model and its scores: one result per test experiment and task."""

    model: Any
    results: list[Result]


def fit(
    model: str,
    data: Any,
    params: dict[str, Any] | None = None,
    seed: int = 0,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    dt: float | None = None,
) -> Fit:
    """Fit one model to one data set in this process, and score it on the test experiments.

    `model` is a registered name or `file.py:Class`; `data` a data set, or what `simgap.load` takes; dt in
    seconds. Raises UnusableInput, and whatever the model's own `fit` raises.
    """
    from simgap.data import load

    built = build(model, params or {})  # first, because data may take seconds to load
    dataset = data if isinstance(data, Dataset) else load(data, inputs=inputs, outputs=outputs, dt=dt)
    about = Result(
        model=model.rpartition(":")[2], params=plain(params or {}), dataset=dataset.name, experiment="",
        task="", seed=seed, status="ok",
        provenance=provenance(threads_in_force()) | {"data_sha256": dataset.sha256},
    )  # fmt: skip
    about = fit_model(built, dataset.training, about)
    results, _ = score_model(built, dataset, [TASKS[name]() for name in USUAL], about)
    return Fit(built, results)


def model_class(reference: str) -> type:
    """Find the class of a registered name, of `file.py:Class`, or of a `file.py` with one. Raises UnusableInput."""
    kind = load_class(reference) if file_of(reference) else MODELS[reference]
    for method in ("fit", "simulate"):
        if not callable(getattr(kind, method, None)):
            raise UnusableInput(f"{reference} is no model: it has no method {method}")
    return kind


def check_params(reference: str, params: dict[str, Any]) -> None:
    """Raises UnusableInput when the model takes no such parameters, or none of such a type."""
    kind = model_class(reference)
    signature, hints = inspect.signature(kind), hints_of(kind)
    try:
        signature.bind(**params)
    except TypeError as error:
        known = ", ".join(signature.parameters) or "none"
        raise UnusableInput(f"{reference}: {error}; its parameters are {known}") from error
    for name, value in params.items():
        if name in hints and not fits(value, hints[name]):
            raise UnusableInput(f"{reference}: {name} = {value!r}, where {in_words(hints[name])} is needed")


def build(reference: str, params: dict[str, Any]) -> Model:
    """Build a model that is not fitted yet. Raises UnusableInput."""
    check_params(reference, params)
    return model_class(reference)(**params)


def fit_model(model: Model, training: TrainingSet, about: Result) -> Result:
    """Fit the model; `about` comes back with what it declares and chose, its size, seconds, threads and warnings."""
    threads = threads_in_force()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        start = time.perf_counter()
        model.fit(training, about.seed)
        seconds = time.perf_counter() - start + earlier_seconds(model)
    n_params = getattr(model, "n_params", None)
    return replace(
        about,
        fitted=_chosen(model),
        n_params=int(n_params) if isinstance(n_params, int | np.integer) else None,
        fit_seconds=seconds,
        message=_shortened("; ".join(dict.fromkeys(str(w.message) for w in caught))),
        provenance=about.provenance | {"threads": threads, "stochastic": is_stochastic(model)},
    )


def _chosen(model: Model) -> dict[str, Any]:
    """What the fit chose, if it is of a size for a line of results."""
    fitted = plain(getattr(model, "fitted", None) or {})
    size = len(json.dumps(fitted))
    if size > LARGEST_FITTED:
        return {"left_out": f"{size} characters, where {LARGEST_FITTED} are taken"}
    return fitted if isinstance(fitted, dict) else {"fitted": fitted}


def score_model(
    model: Model, dataset: Dataset, tasks: Sequence[Task], about: Result
) -> tuple[list[Result], dict[str, Float[np.ndarray, "N ny"]]]:
    """Score every test experiment for every task, and give the free run of each that was simulated.

    A model that fails on one is still asked for the others. Each row has the error on the validation data, too.
    """
    about = replace(about, valid_nrmse=validation_error(model, dataset.training))
    results, runs = [], {}
    for experiment in dataset.test:
        simulate = CheckedSimulation(model, len(dataset.channels.outputs))
        evaluation = Evaluation(simulate, experiment, dataset.n_init, dataset.channels)
        first = sorted(tasks, key=lambda task: task.name != "free_run")  # its row says how long the free run took
        results += [_score(evaluation, simulate, task, about) for task in first]
        if "free_run" in vars(evaluation):  # cached, unless no task asked for it or it was not possible
            runs[experiment.name] = evaluation.free_run
    units = {channel.name: channel.unit for channel in dataset.channels.outputs}
    return [replace(result, units=units) for result in results], runs


def validation_error(model: Model, training: TrainingSet) -> float | None:
    """Compute the error of the free run on validation data of the model as these chose it; None where there is none.

    It is what the model says that it is, where only a cross-validation can tell.
    """
    if not training.without_mere_starts().valid:
        return None
    if isinstance(own := getattr(model, "held_out_error", None), float):
        return own if math.isfinite(own) else None
    try:
        chosen = as_chosen(model)
        if chosen is None:
            return None
        simulate = CheckedSimulation(chosen, len(training.channels.outputs))
        nrmse = free_run_nrmse(simulate, training.valid, training.n_init)
    except (Exception, SystemExit):  # a model may raise anything; what it does on the test is another matter
        return None
    return nrmse if math.isfinite(nrmse) else None


def _score(evaluation: Evaluation, simulate: CheckedSimulation, task: Task, about: Result) -> Result:
    about = replace(about, experiment=evaluation.experiment.name, task=task.name)
    before = simulate.seconds
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # an overflow shows in the figures
            outcome = task.score(evaluation)
    except (Exception, SystemExit) as error:  # a model may raise anything
        metrics = failed_metrics(evaluation.channels)
        return replace(about, status="error", message=reason("simulate", error), metrics=metrics)
    return replace(
        about,
        status="ok" if outcome.finite else "diverged",
        message=about.message if outcome.finite else "the simulation grew beyond all bounds or is not a number",
        metrics=outcome.metrics,
        simulate_seconds=simulate.seconds - before,
    )


@dataclass
class CheckedSimulation:
    """`model.simulate` on copies of the data, with its answer checked and its time added up in `seconds`."""

    model: Any  # a Model, or what a model was before the validation data
    ny: int
    seconds: float = field(default=0.0, init=False)

    def __call__(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Raises ModelFault for a changed input or an answer of the wrong shape."""
        given = {"u": u.copy(), "y_init": y_init.copy()}
        start = time.perf_counter()
        answer = self.model.simulate(given["u"], given["y_init"])
        self.seconds += time.perf_counter() - start
        for name, original in (("u", u), ("y_init", y_init)):
            if not np.array_equal(given[name], original):
                raise ModelFault(f"it changed its argument {name} in place")
        if not isinstance(answer, np.ndarray):
            raise ModelFault(f"it returned a {type(answer).__name__}, where a NumPy array was asked for")
        if answer.dtype != np.float64:
            raise ModelFault(f"it returned {answer.dtype} values, where float64 was asked for")
        expected = (u.shape[0], u.shape[1] - y_init.shape[1], self.ny)
        if answer.shape != expected:
            raise ModelFault(f"it returned the shape {answer.shape}, where {expected} was asked for")
        return np.asarray(answer)


def reason(method: str, error: BaseException) -> str:
    """Say in one line what went wrong in a method of a model, and in which line of whose file."""
    try:
        text = _shortened(" ".join(str(error).split()))
    except Exception as worse:  # of an exception that cannot even say what it is
        text = f"without words, because its __str__ raised {type(worse).__name__}"
    if isinstance(error, UnusableInput):
        return text
    if isinstance(error, ModelFault):
        return f"{method} broke the protocol: {text}"
    frames = traceback.extract_tb(error.__traceback__)
    frame = next((f for f in reversed(frames) if "site-packages" not in f.filename), frames[-1])
    return f"{method} raised {type(error).__name__}: {text} ({Path(frame.filename).name}, line {frame.lineno})"


def _shortened(text: str) -> str:
    return text if len(text) <= LONGEST_MESSAGE else f"{text[:LONGEST_MESSAGE]} ... ({len(text)} characters)"
