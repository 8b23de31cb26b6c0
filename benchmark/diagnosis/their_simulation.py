"""Somebody's simulation in the place of the plain linear model: what it gets wrong, and why."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from simgap.diagnosis import gains
from simgap.diagnosis.answer import Diagnosis
from simgap.diagnosis.side_by_side import SideBySide
from simgap.diagnosis.wrong import wrong
from simgap.findings import Budget, Cause, Findings, Value, Verdict
from simgap.greybox.linear_names import linear_names
from simgap.greybox.model import GreyBoxModel
from simgap.greybox.samples import sizes_of
from simgap.greybox.terms import Term
from simgap.records import Channels, Dataset
from simgap.their_simulation import LinearNumber, TheirSimulation

LINEAR = "linear_part"  # its name in a budget
UNLIKE = 0.05  # of the simulation's variance: what no model repeats, and an answer must say


def judge(answer: Diagnosis, dataset: Dataset, simulated: Dataset, seed: int, views_too: bool = True) -> Diagnosis:
    """Turn the diagnosis of a machine into that of a simulation of it, sample by sample in `simulated`.

    The machine's effects are those that its own records confirm. The same plant is then fitted to the simulation: what
    this does without is missing there, and numbers beyond the machine's 95 % intervals are wrong there.
    """
    found, n = answer.findings, dataset.n_init
    simulated = simulated.with_channels(_with_kinds(dataset.channels, found))
    before = [z.y[n:] for z in simulated.test]
    after = [answer.model.simulate_anew(x, n) for x in dataset.test]
    trusted = found.verdict != "unexplained" and not found.doubts
    sides = [SideBySide.of(plant, dataset, simulated, seed) for plant in answer.model.plants] if trusted else []
    causes = _causes(found, sides, dataset)
    own = answer.model.own_numbers if trusted else ()
    gain = gains.measure(dataset, before, after if trusted else before, own)
    verdict: Verdict = found.verdict
    if trusted:
        verdict = "named" if causes else "nothing_found"
    if verdict == "named" and not (gain.low > 0 and _confirmed(found, sides, causes, dataset, before)):
        verdict = "suspected"
    training = simulated.training.without_mere_starts()
    runs = [z.y[n:] for z in (*training.train, *training.valid)]
    sentences = [f"No model here repeats {100 * side.unlike:.0f} % of the variance of your simulation: what it holds "
                 "beside the named effects is not known." for side in sides if side.unlike > UNLIKE]  # fmt: skip
    findings = replace(
        found,
        verdict=verdict,
        baseline={"order": found.baseline["order"], **gains.errors_by_output(dataset, before)},
        linear=None,
        wrong=wrong(lambda i, x: runs[i][: len(x) - n], dataset, seed) if views_too else (),
        causes=causes if verdict == "named" else (),
        suspects=causes if verdict == "suspected" else (),
        runner_up=None,
        gain=gain,
        checks=(*sentences, *found.checks),
        traces=tuple(replace(t, before=b, after=a) for t, b, a in zip(found.traces, before, after, strict=True)),
        budget=_budgets(found, sides, causes if verdict == "named" else (), dataset, before, after)
        if views_too
        else (),
        simulation=_about(dataset, simulated, sides),
    )
    return Diagnosis(findings, answer.seconds, answer.model)


def _confirmed(
    found: Findings,
    sides: Sequence[SideBySide],
    causes: Sequence[Cause],
    dataset: Dataset,
    before: Sequence[np.ndarray],
) -> bool:
    """Tell whether test data confirm the effects: against the plain model, or in the simulation as it is otherwise."""
    if found.verdict == "named":
        return True
    fitted = [side.corrected([term for _, term in _terms_of(causes, side, dataset)]) for side in sides]
    model = GreyBoxModel(fitted)
    after = [model.simulate_anew(x, dataset.n_init) for x in dataset.test]
    return gains.measure(dataset, before, after, model.own_numbers).low > 0


def _with_kinds(channels: Channels, found: Findings) -> Channels:
    """Say of the simulated outputs what the measured ones were found to be."""
    outputs = tuple(replace(c, kind=found.kinds[c.name], kind_from=found.kinds_from[c.name]) for c in channels.outputs)
    return replace(channels, outputs=outputs)


def _causes(found: Findings, sides: Sequence[SideBySide], dataset: Dataset) -> tuple[Cause, ...]:
    """List what the simulation lacks, has in another size or should not have; what makes the largest error first."""
    known = {cause.key: cause for cause in found.effects}
    listed = []
    for side in sides:
        for term in side.terms:
            holds = side.holds(term)
            if holds is None:
                continue
            cause = known.pop(_key(term, side, dataset), None) or _added(side, term, dataset)
            listed.append(replace(cause, evidence=side.share(term), holds=holds, simulated=_values(side, term)))
        for term in side.terms:
            known.pop(_key(term, side, dataset), None)
    outliers = [replace(cause, holds="missing") for cause in known.values()] if sides else []
    return tuple(outliers + sorted(listed, key=lambda cause: -cause.evidence))


def _key(term: Term, side: SideBySide, dataset: Dataset) -> tuple[str, str, str]:
    """Return the effect, its channel and the output of its plant, as a cause has them."""
    return term.effect.name, _channel(term, side, dataset), _output(side, dataset)


def _output(side: SideBySide, dataset: Dataset) -> str:
    outputs, every = side.machine.outputs, dataset.channels.outputs
    return every[outputs[0]].name if len(outputs) < len(every) else ""


def _channel(term: Term, side: SideBySide, dataset: Dataset) -> str:
    if term.effect.port == "input":
        inputs = dataset.channels.inputs
        return inputs[term.channel].name if term.channel < len(inputs) else "controller"
    return dataset.channels.outputs[side.machine.outputs[term.channel]].name if term.effect.port == "output" else ""


def _added(side: SideBySide, term: Term, dataset: Dataset) -> Cause:
    """Describe an effect that the simulation has and the machine was not found to have."""
    plant, effect = side.machine.estimate.plant, term.effect
    rows = zip(plant.parameters_of(term), *side.numbers(plant.part_of(term)), strict=True)
    values = tuple(Value(p.name, p.unit, float(v), float(a), float(b)) for p, v, a, b in rows if p.told)
    text = effect.describe({value.name: value.value for value in values})
    return Cause(
        effect.name, effect.title, text, effect.reference, _channel(term, side, dataset),
        evidence=0.0, gain=0.0, log_likelihood_ratio=0.0, parameters=values, shows_in=effect.shows_in,
        output=_output(side, dataset),
    )  # fmt: skip


def _values(side: SideBySide, term: Term) -> dict[str, float]:
    """Return the parameters of an effect in the simulation, by name; none where it lacks the effect."""
    if term not in side.theirs:
        return {}
    plant = side.simulation.plant
    named = zip(plant.parameters_of(term), side.simulation.theta[plant.part_of(term)], strict=True)
    return {parameter.name: float(value) for parameter, value in named if parameter.told}


def _about(dataset: Dataset, simulated: Dataset, sides: Sequence[SideBySide]) -> TheirSimulation:
    training, theirs = dataset.training, simulated.training
    pairs = {"train": ((*training.train, *training.valid), (*theirs.train, *theirs.valid)),
             "test": (dataset.test, simulated.test)}  # fmt: skip
    n, errors = dataset.n_init, {}
    for j, channel in enumerate(dataset.channels.outputs):
        e = {
            split: np.concatenate([x.y[n:, j] - z.y[n:, j] for x, z in zip(*pair, strict=True)])
            for split, pair in pairs.items()
        }
        errors[channel.name] = {
            split: {"rmse": float(np.sqrt(np.mean(of**2))), "mae": float(np.mean(np.abs(of)))}
            for split, of in e.items()
        }
    numbers = tuple(number for side in sides for number in linear_numbers(side, dataset))
    share = max((side.share(None) for side in sides), default=0.0)
    differs = any(side.linear_differs() for side in sides)
    return TheirSimulation(errors, numbers, share, differs, max((side.unlike for side in sides), default=0.0))


def linear_numbers(side: SideBySide, dataset: Dataset) -> tuple[LinearNumber, ...]:
    """List the numbers of the linear part, of machine and simulation."""
    plant = side.machine.estimate.plant
    names = linear_names(plant, [channel.name for channel in dataset.channels.inputs])
    rows = zip(names, plant.parameters, *side.numbers(side.linear), side.simulation.theta[side.linear], strict=False)
    return tuple(
        LinearNumber(name, unit, *map(float, (value, low, high, theirs)))
        for (name, unit), parameter, value, low, high, theirs in rows
        if not parameter.fixed
    )


def _budgets(
    found: Findings,
    sides: Sequence[SideBySide],
    causes: Sequence[Cause],
    dataset: Dataset,
    before: Sequence[np.ndarray],
    after: Sequence[np.ndarray],
) -> tuple[Budget, ...]:
    """Divide the simulation's squared test error: the causes in their order, the linear part, and what is left.

    What is learnable and the floor are those of the machine's diagnosis, whose model is the corrected simulation.
    """
    n, y = dataset.n_init, np.concatenate([x.y[dataset.n_init :] for x in dataset.test])
    first = np.mean((y - np.concatenate(before)) ** 2, axis=0)
    rounding = (gains.SMALLEST_ERROR * sizes_of(y)) ** 2
    last = np.mean((y - np.concatenate(after)) ** 2, axis=0)
    divided = []
    for budget, (j, channel) in zip(found.budget, enumerate(dataset.channels.outputs), strict=True):
        if first[j] <= rounding[j]:
            divided.append(Budget(channel.name, {}, math.nan, None, math.nan))
            continue
        shares: dict[str, float] = {}
        side = next((side for side in sides if j in side.machine.outputs), None)
        if side is not None:
            error, at = first[j], side.machine.outputs.index(j)
            for count, key, parts in _stages(side, causes, dataset):
                fitted = side.corrected(parts)
                run = np.concatenate([fitted.simulate_anew(x, n)[:, at] for x in dataset.test])
                now = last[j] if count == 0 else float(np.mean((y[:, j] - run) ** 2))
                shares[key], error = float((error - now) / first[j]), now
        scale = found.gain.before[channel.name] ** 2 / first[j]
        floor = None if budget.floor is None else budget.floor * scale
        learnable = budget.learnable * scale
        divided.append(
            Budget(channel.name, shares, learnable, floor, 1 - sum(shares.values()) - learnable - (floor or 0))
        )
    return tuple(divided)


def _stages(side: SideBySide, causes: Sequence[Cause], dataset: Dataset) -> list[tuple[int, str, list[Term | None]]]:
    """List how many parts are left to correct, the name of the part that is next, and all that is right with it."""
    ordered = _terms_of(causes, side, dataset)
    names = [cause.effect for cause in causes]
    keys = [f"{c.effect}:{c.channel}" if names.count(c.effect) > 1 else c.effect for c, _ in ordered]
    parts: list[Term | None] = [*[term for _, term in ordered], None]
    return [(len(parts) - i - 1, key, parts[: i + 1]) for i, key in enumerate([*keys, LINEAR])]


def _terms_of(causes: Sequence[Cause], side: SideBySide, dataset: Dataset) -> list[tuple[Cause, Term]]:
    """Find the terms of causes on one plant; bad readings have none."""
    by_key = {_key(term, side, dataset): term for term in side.terms}
    return [(c, by_key[c.key]) for c in causes if c.key in by_key]
