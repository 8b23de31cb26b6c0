"""Why nothing can be named on some records: they show the controller, or no model of the plant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from simgap.greybox import dynamics
from simgap.greybox.baseline import Baseline
from simgap.greybox.fitting import Estimate
from simgap.greybox.held_out import BLOCKS, in_most
from simgap.greybox.identification import Identified
from simgap.greybox.samples import PIECE, Records
from simgap.greybox.selection import Selection
from simgap.greybox.trial import has_pieces, squares_in_pieces
from simgap.records import Channels, Experiment, TrainingSet

# Share of the changes of one signal that repeat those of the other in the same sample.
TOGETHER = 0.5
ALIKE = 0.98
FEW = 100  # samples
ENOUGH = 200  # training samples; with fewer, weak effects do not stand out from noise
CERTAIN = 2.0  # standard errors of a correlation
STILL = 0.1  # of how an output moves in training: how it moves in a record in which it stands still


def of_records(training: TrainingSet, channels: Channels) -> str | None:
    """Tell in a sentence why no effect is looked for in these records, whatever a model makes of them."""
    samples = sum(map(len, training.train))
    if samples < BLOCKS:  # a model is judged by as many blocks
        return f"There are only {samples} training samples, which tell no cause; record {ENOUGH} or more."
    return shows_controller((*training.train, *training.valid), channels)


def shows_controller(experiments: Sequence[Experiment], channels: Channels) -> str | None:
    """Tell in a sentence that an output leads an input: then a good model may be the inverse of the controller.

        r(l) = correlation of u(k) - u(k - 1) with y(k + l) - y(k + l - 1)

    An input that is held between samples cannot move the output within the same sample; a controller reads the one and
    sets the other there. So r(0)^2 is large, and r(-1) is larger than r(1) (Box, Jenkins and Reinsel 1994, ch. 11).
    An imposed motion and the force that it takes are no such pair: a spring answers at once.
    """
    for i, u in enumerate(channels.inputs):
        for j, y in enumerate(channels.outputs):
            if u.kind in ("position", "velocity") and y.kind == "other":
                continue
            changes = [(np.diff(x.u[:, i]), np.diff(x.y[:, j])) for x in experiments if len(x) > 3]
            earlier, same, later = (_correlation(changes, lag) for lag in (-1, 0, 1))
            samples = sum(len(of_u) for of_u, _ in changes)
            leads = abs(earlier) - abs(later) > CERTAIN / np.sqrt(max(samples, 1))
            if same**2 > (TOGETHER if leads else ALIKE):
                imposed = f" If {u.name} is an imposed motion and {y.name} a force, give their units in the headings."
                return (
                    f"{u.name} answers {y.name} in the same sample (their changes correlate {same:.2f}): the record "
                    f"shows the controller, and a model of it need not be the plant. Move {u.name} by hand or add a "
                    f"test signal to it, and record again.{'' if leads or u.unit else imposed}"
                )
    return None


def beaten_by_order(one: Identified, channels: Channels) -> str | None:
    """Tell in a sentence that a linear model of another order needs no effect to do as well."""
    if one.linear is None:
        return None
    baseline, chosen = one.selection.baseline, one.selection.trial
    name = channels.outputs[baseline.outputs[0]].name
    effects = [term.effect.title for term in chosen.terms]
    helped = f" with {' and '.join(effects)}" if effects else ""
    rival = f"A linear model of order {one.linear.baseline.plant.order}"
    plain = f"the plain one of order {baseline.plant.order}"
    nothing = "so that no effect can be held responsible for what is wrong"
    if effects and one.linear.baseline.plant.order == baseline.plant.order:
        return f"{rival} simulates held-out {name} at least as well without {' and '.join(effects)}, {nothing}."
    if not effects or one.linear.errs == "no more":
        return f"{rival} simulates held-out {name} at least as well as {plain}{helped}, {nothing}."
    if one.linear.errs == "more":
        return (
            f"{rival} is likelier than {plain}{helped}, which does not simulate held-out {name} clearly better, "
            f"{nothing}."
        )
    return (
        f"{rival} has likelier one-step errors in training than {plain}{helped}, though it simulates held-out {name} "
        f"worse. Neither is the machine, {nothing}."
    )


def beaten_by_mean(selection: Selection, channels: Channels) -> str | None:
    """Tell in a sentence that the best plant beats the mean of a held-out record by no more than chance, and why."""
    baseline, trial = selection.baseline, selection.trial
    if in_most(baseline.blocks_of_mean - trial.blocks) or (trial.terms and _better_in_pieces(baseline, trial.estimate)):
        return None
    records, plant, read = baseline.train, trial.estimate.plant, _readings(baseline.train)
    means, within = np.array([y.mean() for y in read]), np.sqrt(np.mean([y.var() for y in read]))
    still = [y.std() < STILL * within for y in _readings(baseline.valid)]
    poles = -np.real(dynamics.poles(plant, trial.estimate.theta)) if plant.order else np.ones(1)
    name = channels.outputs[baseline.outputs[0]].name
    if not np.ptp(np.concatenate(read)):
        why = f"{name} never moves. Check the sensor and its cable"
    elif len(means) > 1 and np.std(means) > within and not baseline.cut:  # else they are those of pieces
        why = f"{name} works at another operating point in each record. Record around one of them"
    elif poles.min() * records.duration < 1:
        why = f"{name} integrates, so that the smallest offset grows. Record shorter runs, each from a known level"
    elif baseline.valid.samples < FEW:
        why = f"the held-out data have {baseline.valid.samples} samples. Record more"
    elif any(still):
        where = "the held-out record" if len(still) == 1 else f"{sum(still)} of the {len(still)} held-out records"
        why = f"{name} stands still in {where}. Keep it moving to the end of each record"
    else:
        why = f"the inputs do not move {name} enough. Move them more, and faster"
    return f"No model simulates held-out {name} better than its mean, because {why}."


def _readings(records: Records) -> list[Float[np.ndarray, " N"]]:
    return [y[known, 0] for y, known in zip(records.y, records.mask, strict=True) if known.any()]


def _better_in_pieces(baseline: Baseline, estimate: Estimate) -> bool:
    """Tell whether a plant that carries errors on beats the mean of pieces of the held-out records."""
    if not (has_pieces(baseline) and baseline.keeps_errors):
        return False
    return in_most(baseline.squares_of_mean(baseline.valid.pieces(PIECE)) - squares_in_pieces(baseline, estimate))


def _correlation(changes: Sequence[tuple[np.ndarray, np.ndarray]], lag: int) -> float:
    pairs = [
        np.stack((u[max(0, -lag) : len(u) - max(0, lag)], y[max(0, lag) : len(y) - max(0, -lag)])) for u, y in changes
    ]
    joined: Float[np.ndarray, "2 N"] = np.concatenate(pairs or [np.zeros((2, 0))], axis=1)
    sizes = np.sqrt(np.mean(joined**2, axis=1)) if joined.shape[1] else np.zeros(2)
    return float(np.mean(joined[0] / sizes[0] * (joined[1] / sizes[1]))) if sizes.all() else 0.0
