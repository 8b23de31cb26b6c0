"""Settings of a model that suit the validation data best, looked for within a stated time."""

from __future__ import annotations

import json
import math
import statistics
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from simgap.records import Dataset, TrainingSet, UnusableInput
from simgap.results.store import plain
from simgap.running.fitting import build, check_params, validation_error

if TYPE_CHECKING:
    import optuna

EXHAUSTED = 100  # proposals in a row that were tried before: there is hardly another


@dataclass(frozen=True)
class Range:
    """What a parameter may be: a number between two ends, whole where these are, or one of some choices.

    Floats above zero are drawn evenly in their logarithm. Raises UnusableInput.
    """

    name: str
    low: int | float = 0
    high: int | float = 0
    choices: tuple[int | float | str | bool, ...] = ()

    def __post_init__(self) -> None:
        if not self.choices and not -math.inf < self.low < self.high < math.inf:
            raise UnusableInput(f"{self.name} has no range from {self.low} to {self.high}")

    def suggest(self, trial: optuna.Trial) -> Any:
        """Take the value that a trial proposes."""
        if self.choices:
            return trial.suggest_categorical(self.name, self.choices)
        if isinstance(self.low, int) and isinstance(self.high, int):
            return trial.suggest_int(self.name, self.low, self.high)
        drawn = trial.suggest_float(self.name, self.low, self.high, log=self.low > 0)
        return float(f"{drawn:.3g}")  # which a person can read and repeat


@dataclass(frozen=True)
class Trial:
    """Settings, the error of their free run on the validation data over its spread (inf: none), and what they took."""

    params: dict[str, Any]
    error: float
    seconds: float


@dataclass(frozen=True)
class Tuned:
    """All trials, the first with the settings as they were, and the best."""

    model: str
    dataset: str
    seed: int
    budget: float  # seconds
    trials: tuple[Trial, ...]

    @property
    def best(self) -> Trial:
        """The settings with the smallest error; those as they were where no others are better."""
        return min(self.trials, key=lambda trial: trial.error)

    def to_json(self) -> dict[str, Any]:
        """For machines; an error that is not finite is null."""
        trials = [
            {"params": plain(t.params), "error": t.error if math.isfinite(t.error) else None, "seconds": t.seconds}
            for t in self.trials
        ]
        about = {"model": self.model, "dataset": self.dataset, "seed": self.seed, "budget_seconds": self.budget}
        return about | {"best": plain(self.best.params), "trials": trials}

    def to_suite(self, data: str) -> str:
        """Write the best settings as a suite for `simgap run`; `data` is the data set as the suite names it."""
        found = f"{100 * self.trials[0].error:.3g} -> {100 * self.best.error:.3g} percent of the spread"
        spent = f"{len(self.trials)} settings, {self.budget:g} s, seed {self.seed}"
        return (
            f"# Chosen on validation data: {found}; {spent}.\n"
            f"title = {json.dumps(f'{self.model}, tuned on {self.dataset}')}\ndatasets = {json.dumps([data])}\n\n"
            f"[[models]]\nname = {json.dumps(self.model)}\nlabel = {json.dumps(f'{self.model} tuned')}\n"
            f"params = {_toml(plain(self.best.params))}\n"
        )


def _toml(value: Any) -> str:
    """Write a value of JSON as TOML, which has its tables in one line."""
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{name} = {_toml(one)}' for name, one in value.items())} }}"
    return json.dumps(value)


def tune(
    model: str, dataset: Dataset, ranges: Sequence[Range], seconds: float, seed: int = 0,
    params: dict[str, Any] | None = None, seeds: int = 1, listener: Callable[[Trial], None] = lambda trial: None,
) -> Tuned:  # fmt: skip
    """Fit with settings from `ranges` until `seconds` are over, guided by the trials before.

    Tree-structured Parzen estimator (Bergstra et al., NIPS 2011; Optuna). Each trial fits on the training data and is
    judged by the free run over the validation data, in the median of `seeds` fits; the test has no part in it. A fit
    under way is finished. Raises UnusableInput.
    """
    try:
        import optuna
    except ImportError as error:
        raise UnusableInput("simgap tune needs Optuna, which is not installed: pip install 'simgap[tune]'") from error
    given = params or {}
    if not ranges or seconds <= 0 or seeds < 1:
        raise UnusableInput("tuning needs a range, such as units=8:64, a time above zero and at least one seed")
    if not dataset.training.without_mere_starts().valid:
        raise UnusableInput(f"{dataset.name} has no validation data that are longer than {dataset.n_init} samples")
    check_params(model, given | {one.name: one.choices[0] if one.choices else one.low for one in ranges})
    end = time.monotonic() + seconds
    trials: list[Trial] = []

    def attempt(chosen: dict[str, Any]) -> float:
        begin = time.perf_counter()
        errors = [_error(model, chosen, dataset.training, seed + k) for k in range(seeds)]
        trials.append(Trial(chosen, statistics.median_high(errors), time.perf_counter() - begin))
        listener(trials[-1])
        return trials[-1].error

    attempt(given)
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed))
    repeated = 0  # proposals in a row
    while (time.monotonic() < end or len(trials) == 1) and repeated < EXHAUSTED:
        asked = study.ask()
        chosen = given | {one.name: one.suggest(asked) for one in ranges}
        known = next((trial.error for trial in trials if trial.params == chosen), None)
        repeated = 0 if known is None else repeated + 1
        study.tell(asked, attempt(chosen) if known is None else known)
    if not math.isfinite(min(trial.error for trial in trials)):
        raise UnusableInput(f"{model} could be fitted to {dataset.name} with none of these settings")
    return Tuned(model, dataset.name, seed, seconds, tuple(trials))


def _error(model: str, params: dict[str, Any], training: TrainingSet, seed: int) -> float:
    built = build(model, params)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # `simgap run` shows those of the settings that are kept
        try:
            built.fit(training, seed)
        except Exception:  # settings that no fit stands are no reason to stop
            return math.inf
        error = validation_error(built, training)
    return math.inf if error is None else error
