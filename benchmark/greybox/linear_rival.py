"""The best linear model of any order beside the plant that an output's kind asks for, with its effects."""

from __future__ import annotations

import math
from dataclasses import dataclass

from simgap.greybox.baseline import Baseline
from simgap.greybox.held_out import block_errors, in_most
from simgap.greybox.linear import WORTH_AN_ORDER, find_baseline
from simgap.greybox.position_and_velocity import with_kind
from simgap.greybox.selection import BETTER, Selection
from simgap.greybox.trial import CONSISTENT, score_gain
from simgap.records import Channels, TrainingSet

# Of what linear effects take of the error: what a free linear model may take beyond them.
BEYOND = 0.1


@dataclass(frozen=True, eq=False)
class LinearRival:
    """A linear model that the effects do not beat, and whether it errs more than they do in most held-out blocks.

    Then its one-step errors in training are likelier all the same.
    """

    baseline: Baseline
    errs_more: bool


def linear_rival(data: TrainingSet, channels: Channels, selection: Selection) -> LinearRival | None:
    """Fit a linear model of as many poles, zeros and lags as held-out data ask for; None where the effects do better.

    What is nonlinear must score higher than that, and err no more in most held-out blocks. A lag or a delay is a linear
    model itself, of few parameters, and is believed as long as more of them hardly help. None too for an output that is
    no motion and no level, whose plain model is this one already, and where effects are of single experiments and
    cannot be forecast.
    """
    plain, chosen = selection.baseline, selection.trial.estimate
    output, *others = plain.outputs
    if plain.plant.kind == "other" or others or chosen.plant.per_experiment:
        return None
    whole = data.train, data.valid, with_kind(channels, output, "other"), (output,), data.n_init
    linear = find_baseline(*whole, every_reading=not plain.outliers)
    with_effects, without, of_linear = (
        block_errors(fit, plain.valid, data.n_init) for fit in (chosen, plain.estimate, linear.estimate)
    )
    gain = with_effects - of_linear
    # What the readings show needs no better simulation.
    if all(term.effect.linear or term.effect.visible_in_readings for term in chosen.plant.terms):
        error = gain.std() / math.sqrt(len(gain))
        better = gain.mean() > max(WORTH_AN_ORDER * with_effects.mean(), CONSISTENT * error)
        better = better and gain.mean() > BEYOND * (without.mean() - with_effects.mean())
        return LinearRival(linear, errs_more=False) if better else None
    beaten = not in_most(gain) and score_gain(plain, chosen, linear, linear.estimate) > BETTER
    return None if beaten else LinearRival(linear, errs_more=in_most(-gain))
