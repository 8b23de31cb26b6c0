"""Which effects of the catalogue the data ask for: forward selection, backward elimination, exchange."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

from simgap.cores import on_cores
from simgap.greybox.additions import Extended, key_of, with_any_more
from simgap.greybox.baseline import Baseline
from simgap.greybox.fitting import Estimate
from simgap.greybox.search import Round, Search, as_set, only, or_known
from simgap.greybox.terms import Term
from simgap.greybox.trial import Trial, assess, assessed


@dataclass(frozen=True, eq=False)
class Selection:
    """The effects that explain one plant: the model that was chosen, and what it was compared with."""

    baseline: Baseline
    trial: Trial
    noise_order: int
    rounds: tuple[Round, ...]
    extended: Extended
    parts: dict[frozenset[tuple[str, int]], Trial] = field(default_factory=dict)  # with some of the chosen effects only

    @classmethod
    def of_none(cls, baseline: Baseline) -> Selection:
        """Choose no effect, and look for none."""
        return cls(baseline, assess(baseline, baseline.estimate, 0), 0, (), {})

    def only(self, terms: Sequence[Term]) -> Trial:
        """Fit some of the chosen effects again without the others; each choice is fitted once."""
        return self.each_only([terms])[0]

    def each_only(self, choices: Sequence[Sequence[Term]]) -> list[Trial]:
        """Fit each of several choices of the effects again without the others."""
        keys = [as_set(terms) for terms in choices]
        new = {key: terms for key, terms in zip(keys, choices, strict=True) if key not in self.parts}
        new.pop(whole := as_set(self.trial.terms), None)
        fits = on_cores(partial(only, self.baseline, self.trial, self.noise_order), list(new.values()))
        best = [or_known(self.baseline, self.noise_order, self.extended, fit) for fit in fits]
        self.parts.update(zip(new, best, strict=True))
        return [self.trial if key == whole else self.parts[key] for key in keys]

    def without(self, term: Term) -> Trial:
        """Fit the chosen model again with one term less."""
        return self.only([other for other in self.trial.terms if other != term])

    def has_extended(self, trial: Trial) -> bool:
        """Tell whether a model with each candidate added was fitted already."""
        return key_of(trial.terms, "forecast") in self.extended

    def extend(self, trial: Trial) -> list[Trial]:
        """Fit and assess a model with each candidate added; what the selection has fitted is not fitted again."""
        fits = with_any_more(self.baseline, trial.estimate, dict(self.extended))
        return assessed(self.baseline, fits, self.noise_order)


def select(baseline: Baseline, extended: Extended | None = None) -> Selection:
    """Choose effects: what the readings show, what a linear model lacks, then all; superfluous ones are taken out.

    What has numbers of its own in every experiment takes a little of everything, and comes last: where the effects
    that are left beside it are better than those without it, all may join them. What was `extended` before on this
    baseline is not fitted again.
    """
    search = Search(baseline, extended=dict(extended or {}))
    trial = search.visible(assess(baseline, baseline.estimate, 0))
    trial = search.forward(trial, "linear")
    trial = search.settled(search.forward(trial, "forecast"), "forecast")
    # Where an exchange found a better fit, others may join that one; what is known beside this fit is not fitted again.
    larger = search.forward(trial, "forecast")
    trial = search.settled(larger, "forecast") if larger.terms != trial.terms else larger
    trial = search.refined(search.with_own(trial))
    return Selection(baseline, trial, search.noise_order, tuple(search.rounds), search.extended, search.parts)


def select_around(baseline: Baseline, estimate: Estimate) -> Selection:
    """Choose further effects beside those of a fitted model; superfluous ones are taken out."""
    search = Search(baseline)
    trial = search.backward(search.forward(assess(baseline, estimate, 0)))
    return Selection(baseline, trial, search.noise_order, tuple(search.rounds), search.extended, search.parts)
