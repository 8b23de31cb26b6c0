"""What a diagnosis found: plain records, which reports show and `--json` writes."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from simgap.error_views.wrong import ViewName, Wrong
from simgap.records import KindFrom
from simgap.their_simulation import Holds, TheirSimulation

# suspected: effects that passed in training, but their gain on the test split may be chance.
Verdict = Literal["named", "suspected", "nothing_found", "unexplained"]


@dataclass(frozen=True)
class Value:
    """An estimated parameter with its 95 % interval."""

    name: str
    unit: str
    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Separation:
    """An effect that these data do not tell from the named one, and the experiment that would."""

    effect: str
    title: str
    experiment: str


@dataclass(frozen=True)
class Profile:
    """How the squared error of training grows when one parameter is held at other values: 2 (log L_max - log L)."""

    name: str
    unit: str
    values: tuple[float, ...]
    deviance: tuple[float, ...]


@dataclass(frozen=True)
class Cause:
    """A physical effect that the data ask for.

    evidence: share of the plain model's squared error, in training, that the effect explains with those before it;
    gain: share of the squared error on held-out data that is lost again when the effect alone is taken out;
    deciding_experiment: what to record if the effect is only suspected.
    Of somebody's simulation (`holds` says how it has the effect), evidence is the squared error that the effect makes
    by itself, as a share of that simulation's; `simulated` are its own values of the parameters, by their names.
    """

    effect: str
    title: str
    text: str
    reference: str
    channel: str  # the input or output it sits on; empty for a force
    evidence: float
    gain: float
    log_likelihood_ratio: float
    parameters: tuple[Value, ...]
    per_experiment: bool = False
    confounded_with: tuple[Separation, ...] = ()
    shows_in: tuple[ViewName, ...] = ()
    profiles: tuple[Profile, ...] = ()
    deciding_experiment: str = ""
    holds: Holds | None = None
    simulated: dict[str, float] = field(default_factory=dict)
    output: str = ""  # whose plant it was found in, where the outputs have plants of their own

    @property
    def key(self) -> tuple[str, str, str]:
        """Effect, channel and output; an answer has each cause once."""
        return self.effect, self.channel, self.output


@dataclass(frozen=True, eq=False)
class Trace:
    """One test experiment: measured, and simulated before and after the causes, or suspects, were added. t in s."""

    experiment: str
    t: Float[np.ndarray, " N"]
    u: Float[np.ndarray, "N nu"]
    y: Float[np.ndarray, "N ny"]
    before: Float[np.ndarray, "N ny"]
    after: Float[np.ndarray, "N ny"]


# Pieces of one record share its slow disturbances. A wrong effect may follow them a little, but not to half the error.
LARGE_IN_PIECES = 0.5


@dataclass(frozen=True)
class InPieces:
    """The share of a `Gain`, with its 95 % interval, in free runs of so many samples each, one after the other."""

    samples: int
    share: float
    low: float
    high: float


@dataclass(frozen=True)
class Gain:
    """Free-run RMSE on the test split per output; share is 1 - after/before over all outputs, with a 95 % interval.

    After is the model with the causes or, where they are only suspected, with the suspects; `beats_mean` tells whether
    it errs less than the mean of the test data would, on some output. In a plant that integrates an error stays, so
    that a long record is one sample of it: where its free run decides nothing, runs `in_pieces` may.
    """

    before: dict[str, float]
    after: dict[str, float]
    share: float
    low: float
    high: float
    beats_mean: bool = True
    in_pieces: InPieces | None = None

    @property
    def shown(self) -> bool:
        """Whether the test data show that the causes help a simulation that is worth having."""
        in_pieces = self.in_pieces is not None and self.in_pieces.low > LARGE_IN_PIECES and self.share > 0
        return (self.low > 0 or in_pieces) and self.beats_mean

    def to_json(self) -> dict[str, Any]:
        """Return the numbers; that a simulation is worse than the mean shows in the verdict."""
        numbers = {key: value for key, value in vars(self).items() if key not in ("beats_mean", "in_pieces")}
        return numbers | ({"in_pieces": vars(self.in_pieces)} if self.in_pieces else {})


@dataclass(frozen=True)
class Budget:
    """Where the plain model's mean squared error of one output on the test split goes, in shares that sum to 1.

    causes: what each takes on top of those before it, by name (name:channel where an effect sits on several channels),
    negative where it makes the error larger; learnable: what inputs and simulation predict of what the causes leave;
    floor: what repeated runs differ by, None without repeated runs. NaN where the plain model diverges or errs not.
    """

    output: str
    causes: dict[str, float]
    learnable: float
    floor: float | None
    unexplained: float
    # Of a known machine: the mean absolute error of the plain model ("") and with each cause on top of those before it.
    mean_absolute_errors: dict[str, float] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return what stands under the name of the output."""
        left_out = {"output"} if self.mean_absolute_errors else {"output", "mean_absolute_errors"}
        return {key: value for key, value in vars(self).items() if key not in left_out}


@dataclass(frozen=True)
class Offer:
    """A formula for the missing force from a sparse regression: an offer to look at, not a finding."""

    output: str
    formula: str
    explained: float  # share of what the model leaves of the squared error of the output, in training
    unit: str


@dataclass(frozen=True, eq=False)
class Findings:
    """The answer of `simgap.diagnose` about one data set; what the test data do not confirm is suspected."""

    dataset: str
    verdict: Verdict
    baseline: dict[str, Any]  # order, rmse and fit_percent per output
    wrong: tuple[Wrong, ...]
    causes: tuple[Cause, ...]
    runner_up: dict[str, Any] | None  # effect, title, gain, margin (log-likelihood)
    gain: Gain
    seconds: float
    units: dict[str, str] = field(default_factory=dict)
    inputs: tuple[tuple[str, str], ...] = ()  # names and units
    kinds: dict[str, str] = field(default_factory=dict)
    kinds_from: dict[str, KindFrom] = field(default_factory=dict)  # who knows them
    doubts: tuple[str, ...] = ()  # why nothing can be named on these records, one sentence each
    checks: tuple[str, ...] = ()  # what the data checks found, one sentence each
    left: float = 0.0  # share of what remains after the causes that could still be predicted from the input
    offers: tuple[Offer, ...] = ()
    traces: tuple[Trace, ...] = ()
    seed: int = 0
    linear: dict[str, Any] | None = None  # as baseline: the linear model of any order, where it does as well as effects
    suspects: tuple[Cause, ...] = ()  # in the place of causes, or beside them
    budget: tuple[Budget, ...] = ()  # of each output
    simulation: TheirSimulation | None = None  # whose error it is then; else that of the plain linear model

    @property
    def effects(self) -> tuple[Cause, ...]:
        """Those of the model that `gain` and `traces` are of: the causes, or the suspects."""
        return self.causes or self.suspects

    def to_json(self) -> dict[str, Any]:
        """Schema 1 of `simgap diagnose --json`; what is infinite or undefined is null: JSON has no such number."""
        answer = {
            "schema": 1,
            "dataset": self.dataset,
            "verdict": self.verdict,
            "baseline": self.baseline,
            "linear": self.linear,
            "wrong": [
                {"view": w.label, "output": w.output, "share": w.share, "chance": w.chance, "text": w.text}
                for w in self.wrong
            ],
            "causes": [_cause(cause) for cause in self.causes],
            "suspects": [_cause(cause) | {"deciding_experiment": cause.deciding_experiment} for cause in self.suspects],
            "runner_up": self.runner_up,
            "gain": self.gain.to_json(),
            "budget": {b.output: b.to_json() for b in self.budget},
            "kinds": {name: {"kind": kind, "from": self.kinds_from.get(name)} for name, kind in self.kinds.items()},
            "doubts": list(self.doubts),
            "checks": list(self.checks),
            "left": self.left,
            "offers": [vars(offer) for offer in self.offers],
            "seed": self.seed,
            "seconds": self.seconds,
        }
        if self.simulation is not None:
            answer["simulation"] = self.simulation.to_json()
        return _only_numbers(answer)


def _cause(cause: Cause) -> dict[str, Any]:
    of_simulation = {"holds": cause.holds, "simulated": cause.simulated} if cause.holds else {}
    return {
        "effect": cause.effect,
        "title": cause.title,
        "text": cause.text,
        "channel": cause.channel,
        "output": cause.output,
        "evidence": cause.evidence,
        "gain": cause.gain,
        "log_likelihood_ratio": cause.log_likelihood_ratio,
        "parameters": [vars(parameter) for parameter in cause.parameters],
        "per_experiment": cause.per_experiment,
        "confounded_with": [other.effect for other in cause.confounded_with],
        "separate_by": {other.effect: other.experiment for other in cause.confounded_with},
        **of_simulation,
    }


def _only_numbers(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _only_numbers(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_only_numbers(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
