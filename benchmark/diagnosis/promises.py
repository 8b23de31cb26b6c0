"""What a search found, held against test data: which of its effects are named, and which are only suspected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from simgap.diagnosis import gains, unsaid_kinds
from simgap.findings import Cause, Gain
from simgap.greybox import dynamics
from simgap.greybox.evidence import Evidence
from simgap.greybox.model import FittedPlant, GreyBoxModel
from simgap.greybox.plant import MAX_TERMS
from simgap.greybox.terms import Term
from simgap.greybox.trial import MATTERS_AT_ALL
from simgap.records import Dataset

# Of what a search that did not end by itself takes of the error: the least that the effects it rests on must take.
MOST = 0.9


@dataclass(frozen=True, eq=False)
class Promise:
    """Effects that are named, effects that are suspected, and the model with the former or, without any, the latter."""

    causes: tuple[Cause, ...]
    suspects: tuple[Cause, ...]
    named: tuple[Evidence, ...]  # of each plant, with the causes alone
    model: GreyBoxModel
    after: tuple[np.ndarray, ...]  # its simulation of the test experiments
    gain: Gain


def trusted(shares: Sequence[float], most: int = MAX_TERMS) -> int:
    """Count the effects that a search rests on, by the share of the error that each takes on top of those before it.

    A search that was stopped at the largest number of effects might have gone on. It is trusted where less than half
    of them take nearly all of the error that it takes; the others may stand for anything.
    """
    if len(shares) < most:
        return len(shares)
    taken = np.cumsum(shares)
    enough = 1 + int(np.argmax(taken >= MOST * taken[-1]))
    return enough if enough < most / 2 else 0


def rests_on(plant: Evidence) -> Evidence | None:
    """Return the evidence with those effects only that the search rests on; None where it rests on none it found."""
    count = trusted(plant.shares, plant.selection.baseline.plant.most_terms)
    return only(plant, plant.terms[:count]) if count or not plant.terms else None


def promise(
    evidence: Sequence[Evidence], dataset: Dataset, plain: GreyBoxModel, before: Sequence[np.ndarray], profiles: bool
) -> Promise:
    """Withdraw effects, the last first, until the test experiments confirm the gain of those that are left.

    The last of these goes, too, where the simulation is better without it. Where the test confirms none, all are
    suspected. The order was fixed in training; the test data choose no other effect. `before` is the simulation of the
    test experiments by the `plain` model.
    """
    listed = [(plant, term) for plant in _in_order(evidence) for term in plant.terms]
    least = 0 if any(plant.selection.baseline.outliers for plant in evidence) else 1
    found = _causes(evidence, profiles)

    def held(count: int) -> Promise:
        kept = [only(plant, [term for of, term in listed[:count] if of is plant]) for plant in evidence]
        model = GreyBoxModel([plant.identified.plant for plant in kept])
        after = tuple(model.simulate_anew(x, dataset.n_init) for x in dataset.test)
        gain = gains.measure(dataset, before, after, model.own_numbers)
        if not gain.shown and any(map(_keeps_errors, kept)):
            gain = replace(gain, in_pieces=gains.in_pieces(dataset, plain, model))
        return Promise(found, (), tuple(kept), model, after, gain)

    every = held(len(listed))
    confirmed = every if every.gain.shown else None
    for count in range(len(listed) - 1, least - 1, -1):
        if confirmed and confirmed.gain.in_pieces:
            break  # whole experiments, which are compared below, decide nothing
        fewer = held(count)
        if confirmed and not (fewer.gain.shown and _better(fewer, confirmed)):
            break
        confirmed = fewer if fewer.gain.shown else None
    if confirmed is None:
        return replace(every, causes=(), suspects=found, named=())
    if confirmed is every:
        return every
    causes = _causes(confirmed.named, profiles)
    named = {cause.key for cause in causes}
    return replace(confirmed, causes=causes, suspects=tuple(cause for cause in found if cause.key not in named))


def _better(fewer: Promise, more: Promise) -> bool:
    """Tell whether whole test experiments are simulated better with fewer effects, by what matters at all."""
    if fewer.gain.in_pieces:
        return False
    left = [(1 - promise.gain.share) ** 2 for promise in (fewer, more)]
    return left[0] < left[1] - MATTERS_AT_ALL


def _keeps_errors(plant: Evidence) -> bool:
    """Tell whether an error of the state is still there at the end of a record, as where the plant integrates.

    What has numbers of its own in every experiment would have them in every piece, too, and is not asked.
    """
    records, fit = plant.identified.plant.records, plant.identified.plant.estimate
    return not fit.plant.n_own and dynamics.keeps_errors(fit.plant, fit.theta, records.duration)


def _in_order(evidence: Sequence[Evidence]) -> list[Evidence]:
    """Sort the plants, the one that its effects explain best first."""
    return sorted(evidence, key=lambda plant: -plant.explained)


def _causes(evidence: Sequence[Evidence], profiles: bool) -> tuple[Cause, ...]:
    return tuple(
        cause
        for plant in _in_order(evidence)
        for cause in unsaid_kinds.confounded(plant.causes(profiles), plant.identified, plant.channels)
    )


def only(plant: Evidence, terms: Sequence[Term]) -> Evidence:
    """Return the evidence about the same plant with some of its effects only, fitted to all training data again."""
    selection = plant.selection
    if len(terms) == len(selection.trial.terms):
        return plant
    trial = selection.only(terms)
    smaller = FittedPlant.fit(trial.estimate, selection.baseline, plant.identified.plant.experiments)
    return replace(
        plant, identified=replace(plant.identified, selection=replace(selection, trial=trial), plant=smaller)
    )
