"""Which fitted models the records at hand do not tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from simgap.greybox.baseline import Baseline
from simgap.greybox.evidence import CONFOUNDED
from simgap.greybox.fitting import Estimate, descend
from simgap.greybox.identification import Identified
from simgap.greybox.intervals import intervals
from simgap.greybox.machine import ARM, INERTIA, MASS, NAMES
from simgap.greybox.noise import Noise
from simgap.greybox.noise import estimate as noise_of
from simgap.greybox.normal_equations import NormalEquations, scales_of
from simgap.greybox.plant import Plant
from simgap.greybox.problem import Problem
from simgap.greybox.samples import Records
from simgap.greybox.selection import Selection
from simgap.greybox.terms import Term
from simgap.greybox.trial import Trial, significant
from simgap.records import Channels
from simgap.wording import amount

MOST = 4  # rivals of one plant
STEPS = 10
WIDE = 0.1  # half width of an interval, as a share of the value, that is worth a record
NOTHING = 1e-6  # of the information about a number: what is left of it once the others are unknown
FAR = 4.0  # times a value, or a part of it: as far as the ends of an interval go


@dataclass(frozen=True, eq=False)
class Rival:
    """One fitted model: `held` numbers of theta define it, `information` is what the records tell of the others.

    `behind` is how far its score (log-likelihood, less what parameters cost) stays behind that of the best.
    """

    title: str
    estimate: Estimate
    held: Bool[np.ndarray, " p"]
    information: Float[np.ndarray, "p p"]
    behind: float

    @cached_property
    def forecast(self) -> Estimate:
        """The model with its effects, without what belongs to single experiments."""
        return self.estimate.of_all

    @cached_property
    def places(self) -> Int[np.ndarray, " p"]:
        """Where the numbers of that model stand in theta."""
        return self.forecast.plant.places_in(self.estimate.plant)

    def starts(self, experiments: int) -> Float[np.ndarray, "E q"]:
        """Return the usual initial state, for so many experiments."""
        return np.repeat(self.forecast.local.mean(axis=0, keepdims=True), experiments, axis=0)

    def likely(self, count: int) -> Float[np.ndarray, "S p"]:
        """Return theta of `forecast`, and as many draws from what the records leave open of it, from a fixed seed.

        Directions of which they tell nothing stay as they are.
        """
        plant, theta = self.estimate.plant, self.estimate.theta
        scale = scales_of(np.diag(self.information))
        size, along = np.linalg.eigh(self.information / scale / scale[:, None])
        told = size > NOTHING
        normal = np.random.default_rng(0).standard_normal((count, int(told.sum())))
        drawn = theta + (normal / np.sqrt(size[told])) @ along[:, told].T / scale
        return np.concatenate((theta[None], np.clip(drawn, plant.low, plant.high)))[:, self.places]


@dataclass(frozen=True, eq=False)
class Question:
    """The models of one plant that are left, the best first, and the pairs of them that a record should tell apart.

    Without pairs nothing is left open. `interval` names the number of an effect whose interval they are the ends of,
    where the effects themselves are decided; `width` is half of an interval's, as a share of the value.
    """

    rivals: tuple[Rival, ...]
    pairs: tuple[tuple[int, int], ...]
    noise: Noise
    records: Records
    outputs: tuple[int, ...]
    interval: str = ""
    width: float = 0.0


def question_of(identified: Identified) -> Question:
    """List the models whose score is less than 6 behind that of the chosen one.

    They hold another effect in the place of a chosen one, one effect less, or one more that is not certain yet; or they
    are linear and of another order. Where there is none: the two ends of the interval of the inertia of a machine, or
    of the least certain number of an effect, everything else fitted anew.
    """
    selection = identified.selection
    baseline, chosen = selection.baseline, selection.trial
    noise = noise_of(chosen.estimate.errors, baseline.train.mask, selection.noise_order)
    noise = Noise(noise.polynomials, np.maximum(noise.deviations, baseline.resolution))
    of_plant = (noise, baseline.train, baseline.outputs)
    near = _near(selection)
    least = min([0.0, *(behind for behind, _ in near)])  # negative where no effect is certain, but some are likely
    rivals = [
        rival_of(_title(trial.terms), trial.estimate, baseline, noise, behind - least)
        for behind, trial in sorted([(0.0, chosen), *near[:MOST]], key=lambda pair: pair[0])
        if behind - least < CONFOUNDED
    ]
    if identified.linear is not None:
        linear = identified.linear.baseline
        title = f"a linear model of order {linear.plant.order}"
        rivals.append(rival_of(title, linear.estimate, linear, noise, 0.0))
    if len(rivals) > 1:
        return Question(tuple(rivals), tuple((0, i) for i in range(1, len(rivals))), *of_plant)
    ends = _ends(identified, rivals[0], baseline, noise)
    if ends is not None:
        name, width, low, high = ends
        return Question((rivals[0], low, high), ((1, 2),), *of_plant, interval=name, width=width)
    return Question(tuple(rivals), (), *of_plant)


def with_outputs(questions: Sequence[Question], channels: Channels) -> list[Question]:
    """Add the outputs to the titles where there are several plants, which may leave the same open."""
    if len(questions) == 1:
        return list(questions)

    def named(question: Question) -> Question:
        output = " for " + " and ".join(channels.outputs[j].name for j in question.outputs)
        rivals = tuple(replace(rival, title=rival.title + output) for rival in question.rivals)
        return replace(question, rivals=rivals, interval=question.interval and question.interval + output)

    return list(map(named, questions))


def _near(selection: Selection) -> list[tuple[float, Trial]]:
    """List other sets of effects by how far their scores stay behind, the nearest first."""
    baseline, chosen = selection.baseline, selection.trial
    near: dict[frozenset[tuple[str, int]], tuple[float, Trial]] = {}

    def add(trial: Trial) -> None:
        behind, key = chosen.score - trial.score, frozenset(term.key for term in trial.terms)
        if behind < CONFOUNDED and key != frozenset(term.key for term in chosen.terms):
            near.setdefault(key, (behind, trial))

    for term in chosen.terms:
        if term.effect.visible_in_readings:
            continue
        without = selection.without(term)
        add(without)
        if baseline.plant.machine is not None and not selection.has_extended(without):
            continue
        for trial in selection.extend(without):
            new = [t for t in trial.terms if t not in without.terms]
            if new and not new[0].replaces(term) and significant(baseline, without, trial):
                add(trial)
    if not chosen.terms:  # what may be there, and is not certain yet
        for one in selection.rounds[-1:]:
            for trial in one.trials:
                if trial.score > one.before.score:
                    add(trial)
    return sorted(near.values(), key=lambda pair: pair[0])


def _title(terms: Sequence[Term]) -> str:
    return " and ".join(term.effect.title for term in terms) or "the plain linear model"


def rival_of(
    title: str, estimate: Estimate, baseline: Baseline, noise: Noise, behind: float, held: np.ndarray | None = None
) -> Rival:
    """Fit a model under this noise, and compute the information about it: J' J, the numbers of each record apart."""
    plant = estimate.plant
    held = np.zeros(plant.size, dtype=bool) if held is None else held
    problem = Problem(plant, baseline.train, noise)
    fit = descend(problem, estimate.theta, estimate.local, fixed=held, max_steps=STEPS)
    jacobian = problem.jacobian(fit.theta, fit.local, plant.free & ~held)
    nothing = np.zeros((len(fit.local), jacobian.theta.shape[2]))
    information, _ = NormalEquations.of(jacobian, nothing).reduced(0.0)
    return Rival(title, fit, held, np.nan_to_num(information), behind)


def _ends(
    identified: Identified, best: Rival, baseline: Baseline, noise: Noise
) -> tuple[str, float, Rival, Rival] | None:
    """Fit the model with its least certain number at either end of the 95 % interval."""
    plant, theta = best.estimate.plant, best.estimate.theta
    if identified.plant.estimate.plant.terms != plant.terms or identified.linear is not None:
        return None
    listed = _numbers(plant)
    low, high = intervals(identified.plant)
    for i in listed:  # of a number that another may make up for altogether, the bounds are all that is known
        if _is_free(best, i):
            low[i], high[i] = plant.low[i], plant.high[i]
    least, most = np.minimum(theta / FAR, theta * FAR), np.maximum(theta / FAR, theta * FAR)
    low, high = np.clip(low, least, most), np.clip(high, least, most)
    wide = {i: (high[i] - low[i]) / 2 / abs(theta[i]) for i in listed if theta[i] != 0}
    if not wide or max(wide.values()) < WIDE:
        return None
    i = max(wide, key=lambda i: wide[i])
    name, unit = listed[i]
    held, ends = np.arange(plant.size) == i, []
    for value in (float(low[i]), float(high[i])):
        moved = theta.copy()
        moved[i] = value
        start = Estimate(plant, moved, best.estimate.local, best.estimate.errors, np.nan, False)
        end = rival_of("", start, baseline, noise, 0.0, held)
        gain = f", gain {amount(float(end.estimate.theta[plant.layout.gains.start]), '')}" if plant.machine else ""
        ends.append((f"{name} {amount(value, unit)}{gain}", end))
    (of_low, lower), (of_high, upper) = ends
    of_effect = name if plant.machine is None else ""
    return of_effect, wide[i], replace(lower, title=of_low), replace(upper, title=of_high)


def _is_free(rival: Rival, i: int) -> bool:
    """Tell whether other numbers of a model make up for a change of this one."""
    h, others = rival.information, np.flatnonzero(np.diag(rival.information) > 0)
    others = others[others != i]
    scale = np.sqrt(np.diag(h)[others])
    cross = h[others, i] / scale
    inverse = np.linalg.pinv(h[np.ix_(others, others)] / scale / scale[:, None], rcond=1e-11, hermitian=True)
    return bool(h[i, i] - cross @ inverse @ cross < NOTHING * h[i, i])


def _numbers(plant: Plant) -> dict[int, tuple[str, str]]:
    """List the numbers that mean something by themselves: of a machine and of effects, with their units."""
    listed: dict[int, tuple[str, str]] = {}
    if plant.machine is not None:
        constants = [i for i in (INERTIA, MASS, ARM) if plant.free[i]]
        listed |= {i: (NAMES[i].replace("_", " "), "") for i in constants}
    if listed:
        return listed
    for term in plant.terms:
        if term not in plant.per_experiment:
            at = plant.part_of(term).start
            numbers = enumerate(plant.parameters_of(term), start=at)
            listed |= {i: (f"{p.name} of {term.effect.title}", p.unit) for i, p in numbers if not p.fixed}
    return listed
