"""The experiment that would decide: between two effects, or whether one is there."""

from __future__ import annotations

from collections.abc import Sequence

from simgap.error_views.wrong import VIEWS_OF_KINDS, ViewName
from simgap.findings import Separation
from simgap.greybox.effects.effect import Effect
from simgap.records import Kind

# How an error behaves that each view shows.
ERROR_THAT: dict[ViewName, str] = {
    "offset": "is the same everywhere",
    "time since the start": "changes with the time since the start of each experiment",
    "drift within experiment": "drifts within each experiment",
    "experiment": "differs from experiment to experiment",
    "size by experiment": "is large in some experiments only",
    "kind of experiment": "differs with the kind of experiment",
    "size by kind of experiment": "is large in some kinds of experiment only",
    "frequency band": "keeps to one band of frequencies",
    "input": "depends on the size of the input",
    "amplitude": "depends on the amplitude of the output",
    "position": "depends on the position",
    "level": "depends on the level",
    "value": "depends on the value of the output",
    "velocity": "depends on the velocity",
    "rate of change": "depends on the rate of change of the output",
    "sign of velocity": "depends on the direction of motion",
    "time since reversal": "depends on the time since the last reversal",
}

WHOLE_RANGE = "that move the output slowly over its whole range"
# What shows an error of each kind in a test.
EXPERIMENTS_FOR: dict[ViewName, str] = {
    "offset": "at rest, and under the same inputs from several starts",
    "time since the start": "that last longer, the inputs repeated in each",
    "drift within experiment": "that last longer, the inputs repeated in each",
    "experiment": "under the same inputs on several days",
    "size by experiment": "under the same inputs on several days",
    "kind of experiment": "of every kind",
    "size by kind of experiment": "of every kind",
    "frequency band": "with steps, and with sines of several frequencies",
    "input": "with inputs over their whole range",
    "amplitude": "with small and with large inputs of one shape",
    "position": WHOLE_RANGE,
    "level": WHOLE_RANGE,
    "value": WHOLE_RANGE,
    "velocity": "at several speeds, slow and fast",
    "rate of change": "in which the output changes slowly and fast",
    "sign of velocity": "with many reversals",
    "time since reversal": "with many reversals",
}


def separation(effect: Effect, other: Effect, kind: Kind) -> Separation:
    """Describe the experiment that would tell two effects apart on an output of this kind, as either of them knows it.

    Where neither does: a richer input, if the two show in different views, and else a second sensor.
    """
    experiment = effect.confounders.get(other.name) or other.confounders.get(effect.name)
    if not experiment:
        view, of_other = most_telling(effect, kind), most_telling(other, kind)
        experiment = (
            f"vary the amplitude and the speed of the input more: an error that {ERROR_THAT[view]} then speaks for "
            f"{effect.title}, one that {ERROR_THAT[of_other]} for {other.title}"
        )
        if view == of_other:
            of_sensor = effect if effect.port == "output" else other
            experiment = f"add a second sensor: only {of_sensor.title} makes the two readings differ"
    return Separation(other.name, other.title, experiment)


def deciding_experiment(effect: Effect, confounded: Sequence[Separation], kind: Kind) -> str:
    """Describe the experiment that would show whether an effect is there that test data leave open."""
    if confounded:
        return "; ".join(other.experiment.rstrip(".") for other in confounded)
    return f"record more and longer test experiments {EXPERIMENTS_FOR[most_telling(effect, kind)]}"


def most_telling(effect: Effect, kind: Kind) -> ViewName:
    """Return the first view that shows an effect among those of an output of this kind."""
    return next(view for view in effect.shows_in if kind in VIEWS_OF_KINDS.get(view, (kind,)))
