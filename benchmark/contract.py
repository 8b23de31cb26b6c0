"""The contract of a model as checks that say in words what is wrong."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.signal import lfilter

from simgap.protocol import Model, as_chosen
from simgap.records import Experiment, TrainingSet, UnusableInput
from simgap.registry import MODELS
from simgap.results.store import plain
from simgap.running.fitting import CheckedSimulation, ModelFault, check_params, model_class, reason
from simgap.saved.codec import Encoder, decode_model

N_INIT = 10
# Share of the mean square error of `hold` that a model of a linear toy plant may have.
BETTER_THAN_HOLD = 0.5
REFERENCES = ("mean", "hold")  # what the others must beat


def toy_experiment(seed: int, length: int = 160) -> Experiment:
    """A damped second-order plant, its position and velocity [-], one input [-] and a little noise."""
    rng = np.random.default_rng(seed)
    u = np.asarray(lfilter([1], [1, -0.5], rng.standard_normal(length)))
    position = lfilter([0, 0.3, 0.2], [1, -1.3, 0.5], u)
    outputs = np.stack((position, np.gradient(position)), axis=1)
    return Experiment(f"toy{seed}", u[:, None], outputs + 0.01 * rng.standard_normal((length, 2)), 0.1)


def toy_training(first: int = 0) -> TrainingSet:
    """Four experiments to train on and one to validate on."""
    return TrainingSet(tuple(toy_experiment(first + i) for i in range(4)), (toy_experiment(first + 4),), n_init=N_INIT)


@dataclass
class Candidate:
    """A model under test: `build` makes a new one that is not fitted."""

    name: str
    build: Callable[[], Any]

    @cached_property
    def fitted(self) -> Model:
        """The model fitted to the toy data; what goes wrong is said in words by ModelFault."""
        return self.fit(self.build(), toy_training())

    @cached_property
    def refitted(self) -> Model:
        """The same, by an object that was fitted to other data before."""
        other = toy_training(first=50)
        once = self.fit(self.build(), replace(other, train=other.train[:2]))
        return self.fit(once, toy_training())

    def fit(self, model: Any, data: TrainingSet) -> Model:
        """Raises ModelFault."""
        before = [(e.u.copy(), e.y.copy()) for e in data.train + data.valid]
        try:
            model.fit(data, seed=0)
        except (Exception, SystemExit) as error:  # a model may raise anything
            raise ModelFault(reason("fit", error)) from error
        for experiment, (u, y) in zip(data.train + data.valid, before, strict=True):
            if not (np.array_equal(experiment.u, u) and np.array_equal(experiment.y, y)):
                raise ModelFault("fit changed the data it was given")
        return model

    def simulate(self, u: np.ndarray, y_init: np.ndarray, model: Any = None) -> np.ndarray:
        """Raises ModelFault for an answer that the bench would not take."""
        try:
            return CheckedSimulation(model or self.fitted, 2)(u, y_init)
        except ModelFault as error:
            raise ModelFault(f"simulate: {error}") from error
        except (Exception, SystemExit) as error:
            raise ModelFault(reason("simulate", error)) from error

    def one(self, experiment: Experiment, model: Any = None, n: int = N_INIT) -> np.ndarray:
        """The simulation of one experiment, [T-n, ny]."""
        return self.simulate(experiment.u[None], experiment.y[None, :n], model)[0]


def candidate(reference: str, params: dict[str, Any] | None = None) -> Candidate:
    """The model called `reference` (see `simgap.fit`), a network trained for a second. Raises UnusableInput.

    A model of many parts may say in `quick` with which parameters a trial is short.
    """
    kind = model_class(reference)
    network = {"epochs": 6, "batches": 20} if hasattr(kind, "epochs") and hasattr(kind, "batches") else {}
    given = getattr(kind, "quick", network) | (params or {})
    check_params(reference, given)
    return Candidate(reference, lambda: kind(**given))


Check = Callable[[Candidate], None]


def it_has_a_docstring(candidate: Candidate) -> None:
    if not (type(candidate.build()).__doc__ or "").strip():
        raise ModelFault("the class has no docstring; its first line stands in `simgap list models`")


def it_fits_and_says_plainly_what_it_chose(candidate: Candidate) -> None:
    model = candidate.fitted
    n_params = getattr(model, "n_params", None)
    if not isinstance(n_params, int | np.integer | None):
        raise ModelFault(f"n_params is {n_params!r}, which is no whole number")
    if not isinstance(fitted := getattr(model, "fitted", None) or {}, dict):
        raise ModelFault(f"fitted is a {type(fitted).__name__}; make it a dict of what the fit chose")
    json.dumps(plain(fitted), allow_nan=False)
    if not isinstance(stochastic := getattr(model, "stochastic", False), bool):
        raise ModelFault(f"stochastic is {stochastic!r}; make it True where another seed gives other numbers")


def it_returns_the_rows_after_the_start_as_float64(candidate: Candidate) -> None:
    if not np.isfinite(candidate.one(toy_experiment(9))).all():
        raise ModelFault("simulate returned values that are not finite for a plant that is well damped")


def it_says_what_it_was_before_it_was_estimated_on_validation_data(candidate: Candidate) -> None:
    chosen, experiment, training = as_chosen(candidate.fitted), toy_experiment(9), toy_training()
    if chosen is not candidate.fitted:
        if chosen is not None:
            candidate.one(experiment, chosen)
        return
    # Whoever only compares on validation data chooses the same where all of them stand there twice.
    twice = candidate.fit(candidate.build(), replace(training, valid=2 * training.valid))
    why = "fit estimates on the validation data, so it needs a method as_chosen that returns the model before that"
    _alike(candidate.one(experiment), candidate.one(experiment, twice), 1e-9, why)


def a_batch_equals_one_by_one(candidate: Candidate) -> None:
    experiments = [toy_experiment(20 + i) for i in range(3)]
    u, y = (np.stack([getattr(e, column) for e in experiments]) for column in ("u", "y"))
    together = candidate.simulate(u, y[:, :N_INIT])
    alone = np.stack([candidate.one(e) for e in experiments])
    _alike(together, alone, 1e-9, "an experiment is simulated differently when others stand beside it in the batch")


def a_change_of_the_input_changes_nothing_before_it(candidate: Candidate) -> None:
    experiment = toy_experiment(9)
    for at in (N_INIT, 60, 120):
        later = experiment.u.copy()
        later[at:] += 1.0
        changed = Experiment("later", later, experiment.y, experiment.dt)
        before = candidate.one(experiment)[: at - N_INIT], candidate.one(changed)[: at - N_INIT]
        _alike(*before, 1e-12, f"a change of u from sample {at} on changes outputs before it: simulate looks ahead")


def the_input_moves_the_output(candidate: Candidate) -> None:
    experiment = toy_experiment(9)
    still = Experiment("still", np.zeros_like(experiment.u), experiment.y, experiment.dt)
    if candidate.name not in REFERENCES and np.array_equal(candidate.one(experiment), candidate.one(still)):
        raise ModelFault("the simulation is the same without any input")


def it_leaves_its_inputs_as_they_were(candidate: Candidate) -> None:
    candidate.one(toy_experiment(9))  # CheckedSimulation compares


def the_same_seed_gives_the_same_numbers(candidate: Candidate) -> None:
    with contextlib.suppress(ModelFault):
        a_second_fit_forgets_the_first(candidate)
        return  # what forgets its first fit has repeated it
    again = candidate.fit(candidate.build(), toy_training())
    experiment = toy_experiment(9)
    _alike(candidate.one(experiment, again), candidate.one(experiment), 0.0,
           "two fits with the same seed differ; take all randomness from seed")  # fmt: skip


def a_second_fit_forgets_the_first(candidate: Candidate) -> None:
    experiment = toy_experiment(9)
    _alike(candidate.one(experiment, candidate.refitted), candidate.one(experiment), 0.0,
           "a second fit gives other numbers than the first would; fit must start from nothing")  # fmt: skip


def it_starts_from_a_single_sample_and_from_many(candidate: Candidate) -> None:
    for n in (1, 2, 40):
        if not np.isfinite(candidate.one(toy_experiment(9), n=n)).all():
            raise ModelFault(f"started from {n} samples, the simulation is not finite")


def saved_and_loaded_it_simulates_the_same(candidate: Candidate) -> None:
    if candidate.name not in MODELS:
        return  # a file names the model that reads it
    encoder = Encoder()
    text = json.dumps(encoder.model(candidate.fitted), allow_nan=False)
    loaded = decode_model(json.loads(text), encoder.arrays)
    experiment = toy_experiment(9)
    _alike(candidate.one(experiment, loaded), candidate.one(experiment), 0.0, "what was saved simulates differently")


def it_beats_holding_the_last_value(candidate: Candidate) -> None:
    error, held = toy_errors(candidate)
    if candidate.name not in REFERENCES and not error < BETTER_THAN_HOLD * held:
        raise ModelFault(f"its mean square error on the toy plant is {error:.3g}, that of hold is {held:.3g}; "
                         f"at most half of it is asked for")  # fmt: skip


def toy_errors(candidate: Candidate) -> tuple[float, float]:
    """Mean square errors of the free run on two toy experiments: the candidate's, and that of holding y[n-1]."""
    experiments = (toy_experiment(30), toy_experiment(31))
    error = np.mean([(candidate.one(e) - e.y[N_INIT:]) ** 2 for e in experiments])
    held = np.mean([(e.y[N_INIT - 1] - e.y[N_INIT:]) ** 2 for e in experiments])
    return float(error), float(held)


CHECKS: tuple[Check, ...] = (
    it_has_a_docstring,
    it_fits_and_says_plainly_what_it_chose,
    it_says_what_it_was_before_it_was_estimated_on_validation_data,
    it_returns_the_rows_after_the_start_as_float64,
    it_leaves_its_inputs_as_they_were,
    a_batch_equals_one_by_one,
    a_change_of_the_input_changes_nothing_before_it,
    the_input_moves_the_output,
    it_starts_from_a_single_sample_and_from_many,
    the_same_seed_gives_the_same_numbers,
    a_second_fit_forgets_the_first,
    saved_and_loaded_it_simulates_the_same,
    it_beats_holding_the_last_value,
)


@dataclass(frozen=True)
class CheckResult:
    """The name of a check, and what is wrong; empty if all is well."""

    check: str
    wrong: str = ""


def examine(candidate: Candidate) -> Iterator[CheckResult]:
    """Run the checks one after the other; a model that cannot be fitted is not asked for more than a docstring."""
    for check in CHECKS:
        sentence = check.__name__.replace("_", " ")
        try:
            check(candidate)
        except (ModelFault, UnusableInput) as error:
            yield CheckResult(sentence, str(error))
            if check is not it_has_a_docstring and "fitted" not in candidate.__dict__:
                return
        else:
            yield CheckResult(sentence)


def _alike(actual: np.ndarray, expected: np.ndarray, tolerance: float, otherwise: str) -> None:
    difference = np.abs(actual - expected)
    if actual.size and not (difference <= tolerance * (1 + np.abs(expected))).all():
        raise ModelFault(f"{otherwise} (largest difference {np.nanmax(difference):.3g})")
