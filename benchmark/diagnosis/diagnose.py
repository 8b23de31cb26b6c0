"""`simgap.diagnose`: what the simulation gets wrong, which cause, what it gains."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from simgap.cores import all_cores
from simgap.data.formats.plant_table import with_known
from simgap.data.kinds import with_kinds
from simgap.data.loading import read
from simgap.data.simulated_columns import check_simulation, split_off
from simgap.diagnosis import checks, doubts, gains, promises, unsaid_kinds
from simgap.diagnosis.answer import Diagnosis
from simgap.diagnosis.budget import budgets
from simgap.diagnosis.odd_runs import odd_runs
from simgap.diagnosis.their_simulation import judge
from simgap.diagnosis.wrong import wrong
from simgap.findings import Findings, Offer, Trace, Verdict
from simgap.greybox.data_checks import check_numbers
from simgap.greybox.evidence import Evidence
from simgap.greybox.identification import Identified, channels_of, identify
from simgap.greybox.leftover import formula, look_for_more
from simgap.greybox.model import GreyBoxModel
from simgap.records import Channels, Dataset
from simgap.stages import stage

# The named effects leave so much of the plain model's error that the input still predicts: then they are not it.
LEFT_OF_PLAIN = 0.05
LEFT_OF_EXPLAINED = 0.1


def diagnose(
    data: Any,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    dt: float | None = None,
    seed: int = 0,
    profiles: bool = False,
    views_too: bool = True,
    kind: str | Mapping[str, str] | None = None,
    known: Mapping[str, Any] | None = None,
    simulated: str | Sequence[str] | Dataset | None = None,
) -> Diagnosis:
    """Show what a plain linear model gets wrong on a data set, name the physical cause and measure what it gains.

    `data` is a data set, or what `simgap.load` takes; dt in seconds. `seed` draws the resampling of the views and the
    features of the learnable rest. With `profiles` the likelihood profile of every parameter is computed too, as the
    page shows it; without `views_too` the views of the error and its budget are left out. `kind` says what the outputs
    are, and `known` what a table [plant] would say, as in `simgap.load`. With `simulated` it is somebody's simulation
    that is diagnosed instead: the columns that hold its outputs, in the order of the measured ones, or a data set of
    the same experiments with those outputs. Raises UnusableInput.
    """
    begin = time.perf_counter()
    dataset, theirs = _read(data, inputs, outputs, dt, simulated)
    dataset = with_known(with_kinds(dataset, kind), known)
    check_numbers(dataset.test, dataset.channels)
    with all_cores():
        answer = _diagnose(dataset, seed, profiles, views_too)
        if theirs is not None:
            answer = judge(answer, dataset, theirs, seed, views_too)
    return replace(answer, seconds=time.perf_counter() - begin)


def _read(
    data: Any,
    inputs: Sequence[str],
    outputs: Sequence[str],
    dt: float | None,
    simulated: str | Sequence[str] | Dataset | None,
) -> tuple[Dataset, Dataset | None]:
    """Load a data set and, where there is one, somebody's simulation of its outputs."""
    columns = [simulated] if isinstance(simulated, str) else [] if isinstance(simulated, Dataset) else simulated or []
    theirs = simulated if isinstance(simulated, Dataset) else None
    if not isinstance(data, Dataset):
        reading = read(data, inputs, outputs, dt, simulated=columns)
        data, theirs = reading.dataset, theirs or reading.simulated
    elif columns:
        data, theirs = split_off(data, columns)
    if theirs is not None:
        check_simulation(data, theirs)
    return data, theirs


def _diagnose(dataset: Dataset, seed: int, profiles: bool, views_too: bool) -> Diagnosis:
    """Diagnose the plain linear model."""
    training = dataset.training
    hopeless = doubts.of_records(training, dataset.channels)
    identified = identify(training, effects=hopeless is None)
    dataset = dataset.with_channels(channels_of(identified, training))
    plain = GreyBoxModel([one.plain for one in identified])
    before = [gains.free_run(plain, x, dataset.n_init) for x in dataset.test]
    stage("Weighing the evidence")
    evidence = [Evidence(one, dataset.channels) for one in identified]
    doubt = (hopeless,) if hopeless else _doubt(evidence, dataset.channels)
    shares, offers = _left(evidence, dataset)
    trusted = [plant for plant in map(promises.rests_on, evidence) if plant]
    endless = len(trusted) < len(evidence)
    found = any(plant.found for plant in trusted)
    verdict: Verdict = "nothing_found"
    promised = None
    more = any(
        left > max(LEFT_OF_PLAIN, LEFT_OF_EXPLAINED * plant.explained)
        for left, plant in zip(shares, evidence, strict=True)
    )
    if not doubt and (endless or more):
        verdict = "unexplained"
    elif found and not doubt:
        stage("Measuring the gain on the test experiments")
        promised = promises.promise(trusted, dataset, plain, before, profiles)
        verdict = "named" if promised.causes else "suspected"
    if verdict == "nothing_found":
        doubt = doubt or unsaid_kinds.undecided(identified, dataset.channels)
    if views_too:
        stage("Looking at the error and where it goes")
    model = promised.model if promised else GreyBoxModel([one.plant for one in identified])
    findings = Findings(
        dataset=dataset.name,
        verdict=verdict,
        baseline=_plain(plain, dataset, before),
        linear=_linear(identified, dataset),
        wrong=wrong(lambda _, x: gains.free_run(plain, x, dataset.n_init), dataset, seed) if views_too else (),
        causes=promised.causes if promised else (),
        runner_up=_runner_up(trusted) if promised else None,
        gain=promised.gain if promised else gains.measure(dataset, before, before),
        seconds=0.0,
        units={channel.name: channel.unit for channel in dataset.channels.outputs},
        inputs=tuple((channel.name, channel.unit) for channel in dataset.channels.inputs),
        kinds={channel.name: channel.kind for channel in dataset.channels.outputs},
        kinds_from={channel.name: channel.kind_from for channel in dataset.channels.outputs},
        doubts=doubt,
        checks=(
            *odd_runs(model, dataset),
            *unsaid_kinds.taken_for(identified, dataset.channels),
            *checks.limitations(dataset),
        ),
        left=max(shares),
        offers=offers if verdict == "unexplained" else (),
        traces=_traces(dataset, before, promised.after if promised else before),
        seed=seed,
        suspects=promised.suspects if promised else (),
        budget=budgets(promised, plain, dataset, before, seed) if views_too else (),
    )
    return Diagnosis(findings, 0.0, model)


def _doubt(evidence: Sequence[Evidence], channels: Channels) -> tuple[str, ...]:
    """Say why no model of these records can name anything, if so."""
    said = [doubts.beaten_by_mean(plant.selection, channels) for plant in evidence]
    said += [doubts.beaten_by_order(plant.identified, channels) for plant in evidence]
    return tuple(sentence for sentence in said if sentence)


def _runner_up(evidence: Sequence[Evidence]) -> dict[str, Any] | None:
    """Describe the best single effect that was not named, and how far it stayed behind."""
    rivals = [rival for plant in evidence for rival in plant.runners_up()]
    if not rivals:
        return None
    best = max(rivals, key=lambda rival: rival.gain)
    return {"effect": best.effect.name, "title": best.effect.title, "gain": best.gain, "margin": best.behind}


def _plain(plain: GreyBoxModel, dataset: Dataset, before: Sequence[np.ndarray]) -> dict[str, Any]:
    orders = plain.fitted["order"]
    return {"order": orders[0] if len(orders) == 1 else orders, **gains.errors_by_output(dataset, before)}


def _linear(identified: Sequence[Identified], dataset: Dataset) -> dict[str, Any] | None:
    """Describe the best linear models as the plain ones, where any of them does better."""
    if not any(one.linear for one in identified):
        return None
    model = GreyBoxModel([one.plant if one.linear else one.plain for one in identified])
    return _plain(model, dataset, [gains.free_run(model, x, dataset.n_init) for x in dataset.test])


def _left(evidence: Sequence[Evidence], dataset: Dataset) -> tuple[list[float], tuple[Offer, ...]]:
    """Find the share of each plain model's squared error that could still be predicted, and formulas for it."""
    shares, offers = [], []
    for plant in evidence:
        selection = plant.selection
        rest = look_for_more(selection.trial.estimate, selection.baseline.train)
        shares.append(rest.share * (1 - plant.explained))
        channel = dataset.channels.outputs[selection.baseline.outputs[0]]
        if shares[-1] > LEFT_OF_PLAIN and (offer := formula(rest, channel)):
            offers.append(offer)
    return shares, tuple(offers)


def _traces(dataset: Dataset, before: Sequence[np.ndarray], after: Sequence[np.ndarray]) -> tuple[Trace, ...]:
    n = dataset.n_init
    return tuple(
        Trace(x.name, x.dt * np.arange(n, len(x)), x.u[n:], x.y[n:], b, a)
        for x, b, a in zip(dataset.test, before, after, strict=True)
    )
