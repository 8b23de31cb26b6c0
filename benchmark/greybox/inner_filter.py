"""Whether a limit that was found behind a lag lies behind a filter of third order, between two parts of the plant."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from simgap.cores import on_cores
from simgap.greybox.baseline import Baseline
from simgap.greybox.effects.filtered_saturation import FilteredSaturation
from simgap.greybox.effects.inner_saturation import InnerSaturation
from simgap.greybox.fitting import Estimate
from simgap.greybox.held_out import as_good_as_best
from simgap.greybox.linear import with_plain
from simgap.greybox.rivals import is_better_order
from simgap.greybox.selection import Selection, select_around
from simgap.greybox.terms import Term
from simgap.records import Channels

FEW_STEPS = 8  # of a fit until the better starts are known
FINALISTS = 3
ALIKE = 0.4  # of the logarithms of squared frequencies: sections as near as that are one
FASTEST = 1.5  # time constants in a sample: a filter that is faster does not show


def with_inner_filter(selection: Selection, channels: Channels) -> Selection:
    """Select the effects again around a limit behind a filter of third order, where one was found behind a lag.

    The filter takes its poles from those of the plain model. So plants of every order that was tried for that one are
    begun with, each with the filter at every section that any of them has. The selection is the same where this does
    not simulate the records better.
    """
    before, chosen = selection.baseline, selection.trial.estimate
    limits = [term for term in chosen.plant.terms if isinstance(term.effect, InnerSaturation)]
    if not (before.plant.kind == "other" or before.plant.swings) or not limits:
        return selection
    plants = [fit for fit in before.orders or (before.estimate,) if fit.plant.order]
    sections = list(_sections(plants, before))
    if not sections:
        return selection
    limit = limits[0]
    numbers = chosen.theta[chosen.plant.part_of(limit)]
    filtered = Term(FilteredSaturation(), limit.channel)
    fits = on_cores(partial(_fit, before, channels, filtered, numbers, sections), plants)
    errors = [before.held_out_errors(fit) for _, fit in fits]
    other = select_around(*fits[as_good_as_best(errors)])
    return other if is_better_order(other, selection) else selection


def _sections(plants: Sequence[Estimate], baseline: Baseline) -> Iterator[tuple[float, float]]:
    """Yield time constant and damping ratio of each section of second order, those that are alike once."""
    seen: list[float] = []
    for fit in reversed(plants):
        poles = fit.theta[fit.plant.layout.poles]
        for a1, a0 in poles[: len(poles) // 2 * 2].reshape(-1, 2):
            if a0 > 0 and all(abs(np.log(a0) - other) > ALIKE for other in seen):
                seen.append(float(np.log(a0)))
                time_constant = max(float(a0**-0.5), baseline.plant.dt / FASTEST)
                yield time_constant, float(np.clip(0.5 * a1 * time_constant, 0.1, 1.0))


def _fit(
    before: Baseline, channels: Channels, filtered: Term, numbers: np.ndarray,
    sections: Sequence[tuple[float, float]], plain: Estimate,
) -> tuple[Baseline, Estimate]:  # fmt: skip
    """Fit a plain model with a limit behind the best of several filters."""
    baseline = with_plain(before, plain, channels)
    plant = baseline.plant.having([filtered])
    assert plant.scales is not None
    begun = []
    for section in sections:
        theta, local = plant.carry(baseline.plant, plain.theta, plain.local)
        values = FilteredSaturation.begun(numbers, *section, plant.scales.of(filtered))
        part = plant.part_of(filtered)
        theta[part] = np.clip(values, plant.low[part], plant.high[part])
        begun.append((theta, local))
    fits = [baseline.fit(plant.terms, [start], FEW_STEPS) for start in begun]
    fits.sort(key=lambda fit: fit.squares)
    return baseline, baseline.fit(plant.terms, [(fit.theta, fit.local) for fit in fits[:FINALISTS]])
