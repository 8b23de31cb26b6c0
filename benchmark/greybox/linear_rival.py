"""The best linear model of any order beside the plant that an output's kind asks for, with its effects."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from simgap.greybox import dynamics
from simgap.greybox.baseline import Baseline
from simgap.greybox.effects.load_drift import SteadyLoadDrift
from simgap.greybox.effects.periodic_disturbance import PeriodicDisturbance
from simgap.greybox.effects.sensor_drift import SteadySensorDrift
from simgap.greybox.fitting import Estimate
from simgap.greybox.held_out import in_most
from simgap.greybox.linear import WORTH_AN_ORDER, as_other, with_plain
from simgap.greybox.position_and_velocity import with_kind
from simgap.greybox.search import BETTER
from simgap.greybox.selection import Selection
from simgap.greybox.trial import CONSISTENT, HALVES_LEAVE, MATTERS_AT_ALL, halves_speak_for, score_gain
from simgap.records import Channels

# Of what linear effects take of the error: what a free linear model may take beyond them.
BEYOND = 0.1


@dataclass(frozen=True, eq=False)
class LinearRival:
    """A linear model that the effects do not beat, and how much it errs on held-out data beside them.

    Where it errs more, its one-step errors in training are likelier all the same; clearly so if in most blocks.
    """

    baseline: Baseline
    errs: Literal["no more", "more", "clearly more"]

    @classmethod
    def of(cls, linear: Baseline, gain: np.ndarray) -> LinearRival:
        """Compare the squared errors of held-out blocks: those with effects less those of the linear model."""
        return cls(linear, "no more" if gain.mean() >= 0 else "clearly more" if in_most(-gain) else "more")


def linear_rival(channels: Channels, selection: Selection) -> LinearRival | None:
    """Fit a linear model of as many poles, zeros and lags as held-out data ask for; None where the effects do better.

    What is nonlinear must score higher than that, and err no more in most held-out blocks; or leave less than half of
    what the linear model leaves of records that neither was fitted to: no order has such a stand-in. A lag or a delay
    is a linear model itself, of few parameters, and is believed as long as more of them hardly help, be it beside what
    the lag takes of the error or beside what it leaves. None too where effects are of single experiments and cannot be
    forecast, and where the linear model holds a drift or a periodic disturbance as a motion of its own. The orders of
    an output that is no motion and no level have been tried already; see `_of_tried_order`.
    """
    plain, chosen = selection.baseline, selection.trial.estimate
    output, *others = plain.outputs
    if others or chosen.plant.per_experiment:
        return None
    if plain.plant.kind == "other":
        return _of_tried_order(selection, channels)
    linear = as_other(plain, with_kind(channels, output, "other"))
    if moves_by_itself_as(linear.estimate, chosen, plain.train.duration):
        return None
    if _linear_or_visible(chosen):
        with_effects, without, of_linear = map(plain.held_out_errors, (chosen, plain.estimate, linear.estimate))
        far_beyond = _far_beyond(with_effects, without, of_linear)
        return LinearRival.of(linear, with_effects - of_linear) if far_beyond else None
    return _unbeaten(plain, chosen, linear, channels)


def _linear_or_visible(chosen: Estimate) -> bool:
    """Tell whether effects are linear or show in the readings: then a linear model that does as well is no doubt."""
    return all(term.effect.linear or term.effect.visible_in_readings for term in chosen.plant.terms)


def _far_beyond(with_effects: np.ndarray, without: np.ndarray, of_linear: np.ndarray) -> bool:
    """Tell whether a linear model errs so much less on held-out data that linear effects of few numbers are no name."""
    gain = with_effects - of_linear
    error = gain.std() / math.sqrt(len(gain))
    better = gain.mean() > max(WORTH_AN_ORDER * with_effects.mean(), CONSISTENT * error)
    beside_taken = gain.mean() > BEYOND * (without.mean() - with_effects.mean())
    beside_left = of_linear.mean() < HALVES_LEAVE * with_effects.mean()
    matters = gain.mean() > MATTERS_AT_ALL * without.mean()  # half of next to nothing is worth no other order
    return bool(better and (beside_taken or (beside_left and matters)))


def _unbeaten(plain: Baseline, chosen: Estimate, linear: Baseline, channels: Channels) -> LinearRival | None:
    """Find a linear model that nonlinear effects do not beat: the one that held-out data ask for, or another order.

    The simplest that is as good as the best but for chance may lack a pole which effects stand in for.
    """
    gains = _gains(plain, chosen, (linear.estimate, *linear.orders))
    gain, first = next(gains)
    if not _beaten(plain, chosen, gain, linear, first):
        return LinearRival.of(linear, gain)
    unbeaten = [(gain, fit) for gain, fit in gains if not _beaten(plain, chosen, gain, linear, fit)]
    if not unbeaten:
        return None
    gain, best = max(unbeaten, key=_mean)
    return LinearRival.of(with_plain(linear, best, channels), gain)


def _beaten(plain: Baseline, chosen: Estimate, gain: np.ndarray, linear: Baseline, fit: Estimate) -> bool:
    """Tell whether effects score higher than a linear model and err no more, or leave far less of other records."""
    better = not in_most(gain) and score_gain(plain, chosen, linear, fit) > BETTER
    return better or halves_speak_for(plain, chosen, fit)


def moves_by_itself_as(linear: Estimate, chosen: Estimate, duration: float) -> bool:
    """Tell whether a linear model has more poles, undamped as far as records show, at the frequency of a disturbance.

    From their start they swing on as the disturbance does where every record begins at the same phase, or drift on.
    """
    of_linear, of_chosen = (dynamics.poles(fit.plant, fit.theta) for fit in (linear, chosen))

    def more_near(f: float) -> bool:
        near = [np.sum(np.abs(poles - 2j * math.pi * f) < 2 * math.pi / duration) for poles in (of_linear, of_chosen)]
        return bool(near[0] > near[1])

    periodic = [term for term in chosen.plant.terms if isinstance(term.effect, PeriodicDisturbance)]
    frequencies = [chosen.theta[chosen.plant.part_of(term)][1] for term in periodic]
    drifts = any(isinstance(term.effect, SteadySensorDrift | SteadyLoadDrift) for term in chosen.plant.terms)
    return any(map(more_near, frequencies)) or (drifts and more_near(0.0))


def _of_tried_order(selection: Selection, channels: Channels) -> LinearRival | None:
    """Find a linear model that does as well as the effects among the orders that were tried for the plain one.

    The plain model is the simplest whose held-out error is within a standard error of the best; where noise is large
    that is too simple a one, and effects would stand in for the order that it lacks. A rival scores as high as they and
    errs more in no more held-out blocks than by chance; or it is the best on held-out data, and errs less in most.
    """
    plain, chosen = selection.baseline, selection.trial.estimate
    if not plain.orders or all(term.effect.visible_in_readings for term in chosen.plant.terms):
        return None
    rivals = list(_gains(plain, chosen, plain.orders))
    gain, best = max(rivals, key=_mean)
    if not in_most(gain):
        alike = [(gain, fit) for gain, fit in rivals if not in_most(-gain)]
        alike = [(gain, fit) for gain, fit in alike if score_gain(plain, chosen, plain, fit) <= _most(chosen, fit)]
        if not alike:
            return None
        gain, best = max(alike, key=_mean)
    if halves_speak_for(plain, chosen, best):
        return None
    return LinearRival.of(with_plain(plain, best, channels), gain)


def _most(chosen: Estimate, rival: Estimate) -> float:
    """Return by how much effects may score higher than a linear model that does as well.

    Of linear effects and a linear model that score alike, the one of fewer numbers is the better name.
    """
    fewer = chosen.plant.free.sum() < rival.plant.free.sum()
    return 0.0 if fewer and _linear_or_visible(chosen) else BETTER


def _gains(plain: Baseline, chosen: Estimate, fits: Sequence[Estimate]) -> Iterator[tuple[np.ndarray, Estimate]]:
    """Yield linear models with how much less than the effects each errs on held-out blocks."""
    with_effects = plain.held_out_errors(chosen)
    yield from ((with_effects - plain.held_out_errors(fit), fit) for fit in fits)


def _mean(rival: tuple[np.ndarray, Estimate]) -> float:
    return float(rival[0].mean())
