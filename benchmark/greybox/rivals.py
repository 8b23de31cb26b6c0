"""Other plants than the one that the effects were selected on: of a higher order, or of several masses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simgap.greybox.baseline import Baseline
from simgap.greybox.fitting import Estimate
from simgap.greybox.held_out import in_most
from simgap.greybox.joint import on_joint, with_joint
from simgap.greybox.leftover import look_for_more
from simgap.greybox.linear import first_order_hold, with_plain
from simgap.greybox.plant import Plant
from simgap.greybox.pole_search import fit_plain
from simgap.greybox.score_test import candidates
from simgap.greybox.search import BETTER
from simgap.greybox.selection import Selection, select
from simgap.greybox.trial import MATTERS, score_gain
from simgap.records import Channels

MAX_ORDER = 4  # with effects: every order is another search
UNEXPLAINED = 0.05  # of the plain model's squared error: more that is left, or that the input still predicts


def of_better_order(selection: Selection, channels: Channels) -> Selection:
    """Select the effects on plants of one order more, as long as that simulates the records better.

    The order of the plain model is chosen without effects; a saturation, say, makes one lag too few look enough, and
    other effects then stand in for that lag. More parameters must show in most of the held-out blocks.
    """
    more = 1
    while _asks_for_order(selection):
        larger = of_higher_order(selection, more, channels)
        if larger is None:
            break
        other = select(larger)
        if is_better_order(other, selection):
            selection, more = other, 1
        elif more == 1 and _may_lose_sign(selection.baseline):
            more = 2  # a resonance takes two
        else:
            break
    baseline, left = selection.baseline, selection.trial.estimate.squares
    folded = baseline.plant.kind == "velocity" and _may_lose_sign(baseline)
    if folded and left > UNEXPLAINED * baseline.estimate.squares:
        other = select(_with_zeros(baseline, channels))
        return other if is_better_order(other, selection) else selection
    return selection


def _with_zeros(baseline: Baseline, channels: Channels) -> Baseline:
    """Fit the plain model of the highest order with all its zeros, as others swing beside the mass that is measured.

    The signs that the readings have lost are found with it where they are not with fewer poles and none of the zeros.
    """
    fit = _grown(baseline, range(1, MAX_ORDER + 1), with_zeros=True)
    return with_plain(baseline, fit, channels)


def _grown(baseline: Baseline, orders: range, with_zeros: bool) -> Estimate:
    """Fit plain models of rising order, each from the poles of the one before; return the last."""
    fit = baseline.estimate
    for order in orders:
        zeros = order - 1 if with_zeros else 0
        plant = Plant(baseline.plant.kind, order, baseline.plant.nu, baseline.plant.dt, zeros=zeros, offset=True)
        fit = fit_plain(plant, baseline.train, fit if order > 2 else None)
    return fit


def _asks_for_order(selection: Selection) -> bool:
    """Tell whether a lag may be missing beside effects, or a second mass where one leaves much of a velocity open."""
    baseline, chosen = selection.baseline, selection.trial.estimate
    if baseline.plant.kind == "velocity" and not _may_lose_sign(baseline):
        left = look_for_more(chosen, baseline.train).share * chosen.squares / baseline.estimate.squares
        return left > UNEXPLAINED
    return _may_lose_sign(baseline) or any(not term.effect.linear for term in selection.trial.terms)


def _may_lose_sign(baseline: Baseline) -> bool:
    """Tell whether the readings may have lost their sign: then no plain model of them says anything of the order."""
    return any(term.effect.hides_sign for term in candidates(baseline))


def of_higher_order(selection: Selection, more: int, channels: Channels) -> Baseline | None:
    """Fit the plain model of so many orders more; None where the kind of the output gives the order.

    The lags that were found beside one mass are order of a drive of several.
    """
    baseline = selection.baseline
    kind, order, records = baseline.plant.kind, baseline.plant.order, baseline.train
    if kind == "velocity" and order == 1:
        more += sum(term.effect.adds_pole for term in selection.trial.terms)
    if kind == "position" or order + more > MAX_ORDER:
        return None
    fit = _grown(baseline, range(order + 1, order + more + 1), with_zeros=False)
    fit = first_order_hold(fit, records, baseline.valid, baseline.n_init) or fit
    return with_plain(baseline, fit, channels)


def is_better_order(other: Selection, before: Selection) -> bool:
    """Tell whether effects on a plant of higher order err less on most held-out blocks, or in the mean at no cost."""
    was, now = (of.baseline.held_out_errors(of.trial.estimate) for of in (before, other))
    as_few = other.trial.cost <= before.trial.cost and now.mean() < was.mean()
    return (as_few or in_most(was - now)) and is_better(other.trial.estimate, other.baseline, before)


def of_several_masses(linear: Baseline, before: Selection, channels: Channels) -> Selection | None:
    """Select the effects on a velocity whose linear model has the order of several masses; None where it needs none.

    The linear model simulates the records better than one mass with effects, and may lack these effects itself. Where
    its order is too high for them, they are selected on the best one below, and must then do better than it does.
    """

    plants = [fit for fit in (linear.estimate, *linear.orders) if 1 < fit.plant.order <= MAX_ORDER]
    if before.baseline.plant.kind != "velocity" or not plants:
        return None
    left = linear.held_out_errors
    fit = linear.estimate if linear.estimate in plants else min(plants, key=lambda fit: left(fit).mean())
    plain = replace(fit, plant=replace(fit.plant, kind="velocity"))
    found = select(with_plain(linear, plain, channels))
    chosen = found.trial.estimate
    better = score_gain(found.baseline, chosen, linear, linear.estimate) > BETTER
    better = better and not in_most(left(chosen) - left(linear.estimate))
    return found if found.trial.terms and better else None


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
