"""Whether a drive whose position is measured has a flexible joint, and whether that adds to its effects."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from simgap.greybox import two_masses
from simgap.greybox.baseline import Baseline
from simgap.greybox.fitting import Estimate
from simgap.greybox.linear import WORTH_AN_ORDER, block_errors, scaled
from simgap.greybox.noise import schwarz_order
from simgap.greybox.plant import Plant
from simgap.greybox.pole_search import fit_plain
from simgap.greybox.selection import BETTER, Selection
from simgap.greybox.trial import MATTERS, assess
from simgap.records import Channels

FEWEST_SAMPLES = 50  # of a record that may show how a joint swings
SIDES: tuple[two_masses.Side, ...] = ("motor", "load")


def with_joint(baseline: Baseline, channels: Channels, n_init: int) -> Baseline | None:
    """Put a flexible joint into a drive whose position is measured, on either side; None where none is seen to swing.

    It must lower the held-out error as a higher order must, by more than a standard error.
    """
    rigid, records, dt = baseline.plant, baseline.train, baseline.plant.dt
    if rigid.kind != "position" or rigid.order != 2 or rigid.joint or len(records.u[0]) < FEWEST_SAMPLES:
        return None
    poles = baseline.estimate.theta[rigid.layout.poles]
    tried = []
    shapes = list(two_masses.shapes(poles, records.duration, dt))
    for side in SIDES:
        plant = Plant(
            "position", 4, rigid.nu, dt, two_outputs=rigid.two_outputs, offset=rigid.offset, taps=rigid.taps, joint=side
        )
        fit = fit_plain(plant, records, shapes=shapes)
        shapes = [*shapes[::4], list(fit.theta[plant.layout.poles])]  # both sides have the same poles
        if two_masses.swings(fit.theta[plant.layout.poles], records.duration, dt):
            tried.append(fit)
    before = block_errors(baseline.estimate, baseline.valid, n_init)
    errors = [block_errors(fit, baseline.valid, n_init) for fit in tried]
    best = min(range(len(tried)), key=lambda i: float(errors[i].mean()), default=None)
    if best is None:
        return None
    gain = before - errors[best]
    if not gain.mean() > max(WORTH_AN_ORDER * before.mean(), gain.std() / math.sqrt(len(gain))):
        return None
    return replace(baseline, estimate=scaled(tried[best], records, channels, baseline.outputs))


def on_joint(joint: Baseline, rigid: Estimate) -> Estimate:
    """Fit the effects of a rigid drive on one with a joint."""
    plant = joint.plant.having(rigid.plant.terms)
    theta, local = plant.carry(joint.plant, joint.estimate.theta, joint.estimate.local)
    for term in plant.terms:
        if term in plant.per_experiment:
            local[:, plant.local_index(term)] = rigid.local[:, rigid.plant.local_index(term)]
        else:
            theta[plant.part_of(term)] = rigid.theta[rigid.plant.part_of(term)]
    return joint.fit(plant.terms, [(theta, local)])


def is_better(estimate: Estimate, joint: Baseline, rigid: Selection) -> bool:
    """Tell whether a drive with a joint errs clearly less, and has the higher score under noise of one memory."""
    chosen, noise = rigid.trial.estimate, rigid.baseline.noise
    squares = [float(np.sum(noise.whiten(fit.errors) ** 2)) for fit in (estimate, chosen)]
    if squares[0] > (1 - MATTERS) * squares[1]:
        return False
    order = max(rigid.noise_order, schwarz_order(estimate.errors, joint.train.mask, joint.resolution))
    flexible = assess(joint, estimate, order)
    return flexible.score > assess(rigid.baseline, chosen, order).score + BETTER
