"""One case of the recovery study: effects hidden in a simulated rig, what a model that knows them gains, the answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Any

import numpy as np

from simgap.records import Dataset, Status

# What the reference that knows the effect must gain for the effect to count as visible.
VISIBLE_GAIN = 0.03  # of the squared error on the test experiments
VISIBLE_RATIO = 15.0  # log-likelihood


@dataclass(frozen=True)
class Case:
    """What is hidden where: effects, comma-separated, with one strength; noise and its colour; the seed of the data."""

    rig: str
    effects: str
    strength: float
    noise: float
    colour: float
    seed: int

    def hidden(self) -> dict[str, float]:
        """Effect to strength."""
        return dict.fromkeys(self.effects.split(","), self.strength) if self.effects else {}

    def __str__(self) -> str:
        return f"{self.effects or 'nothing'} in {self.rig}, seed {self.seed}"


@dataclass(frozen=True)
class CaseResult:
    """One row of the study: what the known-effect reference gains, what the diagnosis said, or why there is neither.

    The reference is the grey box fitted with the effects that are hidden; None where none is hidden or the catalogue
    does not hold one.
    """

    case: Case
    status: Status = "ok"
    message: str = ""
    visible: bool = False
    reference_gain: float | None = None  # share of the squared error on the test experiments
    reference_ratio: float | None = None  # log-likelihood ratio in training
    verdict: str = ""
    named: tuple[str, ...] = ()
    confounded: tuple[tuple[str, ...], ...] = ()
    gain: float = 0.0
    seconds: float = 0.0
    code_sha256: str = ""

    @property
    def right(self) -> bool:
        """Whether the answer is right: nothing for nothing, unexplained for what no catalogue holds, else the name.

        A pair that is said to be confounded is right if the truth is in it. Of two effects both must be named.
        """
        from simgap.registry import EFFECTS

        hidden = list(self.case.hidden())
        if not hidden:
            return self.verdict == "nothing_found"
        if any(name not in EFFECTS for name in hidden):
            return self.verdict == "unexplained"
        answers = [{name, *others} for name, others in zip(self.named, self.confounded, strict=True)]
        if len(hidden) == 1:
            return bool(answers) and hidden[0] in answers[0]
        return any(all(map(set.__contains__, some, hidden)) for some in permutations(answers, len(hidden)))


def room_of(rig: str) -> Any:
    """Return the room that a rig stands in: the test rigs, or the machines in the field."""
    from simgap.data.simulated import field, rigs

    return field if rig in field.RIGS else rigs


def solve(case: Case) -> CaseResult:
    """Make the data, fit the reference, diagnose. Raises whatever these raise."""
    from simgap.diagnosis.diagnose import diagnose

    dataset = room_of(case.rig).hide(case.rig, case.hidden(), case.noise, case.colour, case.seed)
    reference = known_effect_reference(dataset, tuple(case.hidden()))
    answer = diagnose(dataset, views_too=False)
    before, after = answer.findings.gain.before, answer.findings.gain.after
    name = next(iter(before))
    gain, ratio = reference or (None, None)
    return CaseResult(
        case,
        # What lies outside the catalogue is taken to be visible.
        visible=gain > VISIBLE_GAIN and ratio > VISIBLE_RATIO if gain is not None and ratio is not None
        else bool(case.effects),
        reference_gain=gain,
        reference_ratio=ratio,
        verdict=answer.verdict,
        named=tuple(cause.effect for cause in answer.causes),
        confounded=tuple(tuple(s.effect for s in cause.confounded_with) for cause in answer.causes),
        gain=float(1 - (after[name] / before[name]) ** 2),
        seconds=answer.seconds,
    )  # fmt: skip


def known_effect_reference(dataset: Dataset, hidden: Sequence[str]) -> tuple[float, float] | None:
    """What the grey box gains that knows the effects: share of the squared test error, and log-likelihood ratio."""
    from simgap.diagnosis import gains
    from simgap.registry import EFFECTS, MODELS

    if not hidden or any(name not in EFFECTS for name in hidden):
        return None
    squares, likelihood = [], []
    for effects in ((), tuple(hidden)):
        model: Any = MODELS["greybox"](effects=effects)
        model.fit(dataset.training, 0)
        runs = [
            model.simulate_anew(x, dataset.n_init) if effects else gains.free_run(model, x, dataset.n_init)
            for x in dataset.test
        ]
        errors = [
            np.sum((x.y[dataset.n_init :, 0] - run[:, 0]) ** 2) for x, run in zip(dataset.test, runs, strict=True)
        ]
        squares.append(sum(errors))
        likelihood.append(model.log_likelihood())
    ratio = likelihood[1] - likelihood[0] + sum(off.log_likelihood_ratio for p in model.plants for off in p.outliers)
    return float(1 - squares[1] / squares[0]), float(ratio)
