"""Whether a drive whose position is measured has a flexible joint, and whether that adds to its effects."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from simgap.greybox import two_masses
from simgap.greybox.baseline import Baseline
from simgap.greybox.fitting import Estimate, descend
from simgap.greybox.held_out import block_errors
from simgap.greybox.linear import WORTH_AN_ORDER, with_plain
from simgap.greybox.plant import Plant
from simgap.greybox.pole_search import fit_plain
from simgap.greybox.problem import Problem
from simgap.greybox.selection import Selection
from simgap.greybox.terms import Term
from simgap.records import Channels
from simgap.registry import EFFECTS

FEWEST_SAMPLES = 50  # of a record that may show how a joint swings
SHARES = (0.4, 0.8)
SIDES: tuple[two_masses.Side, ...] = ("motor", "load")


def with_joint(rigid: Selection, channels: Channels) -> Baseline | None:
    """Put a flexible joint into a drive whose position is measured, on either side; None where none is seen to swing.

    It must lower the held-out error as a higher order must, by more than a standard error: that of the plain drive, or
    with the effects of the rigid drive beside it, which may hide how a joint swings.
    """
    baseline, chosen = rigid.baseline, rigid.trial.estimate
    plant, records, dt = baseline.plant, baseline.train, baseline.plant.dt
    if plant.kind != "position" or plant.order != 2 or plant.joint or len(records.u[0]) < FEWEST_SAMPLES:
        return None
    best, least = None, math.inf
    beside = ((chosen, terms, values) for terms, values in _beside(chosen))
    for before, terms, values in ((baseline.estimate, (), ()), *beside):
        to_beat = block_errors(before, baseline.valid, baseline.n_init, None)
        shapes = list(two_masses.shapes(before.theta[plant.layout.poles], records.duration, dt))
        for side in SIDES:
            joint = Plant(
                "position", 4, plant.nu, dt, two_outputs=plant.two_outputs, offset=plant.offset, taps=plant.taps,
                joint=side, scales=plant.scales,
            ).having(terms)  # fmt: skip
            fit = fit_plain(joint, records, shapes=shapes, of_terms=values)
            shapes = [*shapes[::4], list(fit.theta[joint.layout.poles])]  # both sides have the same poles
            left = block_errors(fit, baseline.valid, baseline.n_init, None)
            gain = to_beat - left
            seen = two_masses.swings(fit.theta[joint.layout.poles], records.duration, dt)
            enough = gain.mean() > max(WORTH_AN_ORDER * to_beat.mean(), gain.std() / math.sqrt(len(gain)))
            if seen and enough and left.mean() < least:
                best, least = fit, (1 - WORTH_AN_ORDER) * float(left.mean())
    if best is None:
        return None
    return with_plain(baseline, _without_effects(best, baseline), channels)


def _without_effects(fit: Estimate, baseline: Baseline) -> Estimate:
    """Keep the joint that was found beside effects; without them no fit would, so the gains alone are fitted anew."""
    plant = fit.plant.having(())
    fixed = np.full(plant.size, bool(fit.plant.terms))
    fixed[plant.layout.gains] = fixed[plant.layout.offset] = False
    return descend(Problem(plant, baseline.train, baseline.noise), fit.theta[: plant.size], fixed=fixed)


def _beside(chosen: Estimate) -> Iterator[tuple[Sequence[Term], list[float]]]:
    """Yield the effects of a rigid drive and their parameters; a delay in the place of its delay and lags.

    A joint may be part of them, so the delay begins with two shares of their sum.
    """
    plant, values, late = chosen.plant, {}, 0.0
    for term in plant.terms:
        if term in plant.per_experiment:
            continue
        of_term = list(chosen.theta[plant.part_of(term)])
        if term.effect.linear and plant.parameters_of(term)[0].unit == "s":
            late += float(of_term[0])
        else:
            values[term.key] = term, of_term
    delay = Term(EFFECTS["input_delay"]())
    for begun in [{delay.key: (delay, [share * late])} for share in SHARES] if late else [{}]:
        both = values | begun
        if both:
            terms = plant.having([term for term, _ in both.values()]).terms
            yield terms, [value for term in terms for value in both[term.key][1]]


def on_joint(joint: Baseline, rigid: Estimate) -> Estimate:
    """Fit the effects of a rigid drive on one with a joint."""
    plant = joint.plant.having(rigid.plant.terms)
    theta, local = plant.carry(joint.plant, joint.estimate.theta, joint.estimate.local)
    for term in plant.terms:
        theta[plant.part_of(term)] = rigid.theta[rigid.plant.part_of(term)]
        if term in plant.per_experiment:
            local[:, plant.own_part_of(term)] = rigid.local[:, rigid.plant.own_part_of(term)]
    return joint.fit(plant.terms, [(theta, local)])
