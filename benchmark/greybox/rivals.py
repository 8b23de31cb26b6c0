"""Other plants than the one that the effects were selected on: of a higher order, or with a flexible joint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simgap.greybox.baseline import Baseline
from simgap.greybox.fitting import Estimate
from simgap.greybox.held_out import block_errors, in_most
from simgap.greybox.joint import on_joint, with_joint
from simgap.greybox.leftover import look_for_more
from simgap.greybox.linear import MAX_ORDER, first_order_hold, scaled
from simgap.greybox.plant import Plant
from simgap.greybox.pole_search import fit_plain
from simgap.greybox.selection import BETTER, Selection, select
from simgap.greybox.trial import MATTERS, score_gain
from simgap.records import Channels

UNEXPLAINED = 0.05  # of the plain model's squared error: more that the input still predicts


def of_better_order(selection: Selection, channels: Channels) -> Selection:
    """Select the effects on plants of one order more, as long as that simulates the records better.

    The order of the plain model is chosen without effects; a saturation, say, makes one lag too few look enough, and
    other effects then stand in for that lag. More parameters must show in most of the held-out blocks.
    """
    while _asks_for_order(selection):
        larger = of_next_order(selection.baseline, channels)
        if larger is None:
            break
        other = select(larger)
        before, after = (
            block_errors(of.trial.estimate, of.baseline.valid, of.baseline.n_init) for of in (selection, other)
        )
        as_few = other.trial.cost <= selection.trial.cost and after.mean() < before.mean()
        if not (as_few or in_most(before - after)) or not is_better(other.trial.estimate, larger, selection):
            break
        selection = other
    return selection


def _asks_for_order(selection: Selection) -> bool:
    """Tell whether a lag may be missing beside effects; a velocity is one mass's unless that leaves much unexplained."""
    baseline, chosen = selection.baseline, selection.trial.estimate
    if baseline.plant.kind == "velocity":
        left = look_for_more(chosen, baseline.train).share * chosen.squares / baseline.squares
        return left > UNEXPLAINED
    return any(not term.effect.linear for term in selection.trial.terms)


def of_next_order(baseline: Baseline, channels: Channels) -> Baseline | None:
    """Fit the plain model of one order more; None where the kind of the output gives the order.

    What moves as more than one mass has no place where the forces of one mass act: its velocity is like any output.
    """
    before, records = baseline.plant, baseline.train
    if before.kind == "position" or before.order == MAX_ORDER:
        return None
    kind = "other" if before.kind == "velocity" else before.kind
    plant = Plant(kind, before.order + 1, before.nu, before.dt, offset=True)
    fit = fit_plain(plant, records, baseline.estimate if plant.order > 2 else None)
    fit = first_order_hold(fit, records, baseline.valid, baseline.n_init) or fit
    return replace(baseline, estimate=scaled(fit, records, channels, baseline.outputs))


def of_better_joint(rigid: Selection, channels: Channels) -> Selection:
    """Select the effects of a drive with a flexible joint, where that simulates the records better."""
    joint = with_joint(rigid, channels)
    if joint is None or not is_better(on_joint(joint, rigid.trial.estimate), joint, rigid):
        return rigid
    flexible = select(joint)
    return flexible if is_better(flexible.trial.estimate, joint, rigid) else rigid


def is_better(estimate: Estimate, baseline: Baseline, before: Selection) -> bool:
    """Tell whether a model of another plant errs clearly less than the one before, and has the higher score."""
    chosen, noise = before.trial.estimate, before.baseline.noise
    squares = [float(np.sum(noise.whiten(fit.errors) ** 2)) for fit in (estimate, chosen)]
    clearly = squares[0] < (1 - MATTERS) * squares[1]
    return clearly and score_gain(baseline, estimate, before.baseline, chosen) > BETTER
