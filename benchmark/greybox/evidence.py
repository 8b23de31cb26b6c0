"""What speaks for each effect that was selected, in the records of a diagnosis."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simgap.error_views.correlation import correlation_time
from simgap.findings import Cause, Profile, Value
from simgap.greybox.deciding import deciding_experiment, separation
from simgap.greybox.effects.effect import Effect
from simgap.greybox.effects.outliers import Outliers as OutlierEffect
from simgap.greybox.fitting import descend
from simgap.greybox.identification import Identified
from simgap.greybox.intervals import intervals
from simgap.greybox.outliers import Outliers
from simgap.greybox.problem import Problem
from simgap.greybox.selection import Selection
from simgap.greybox.terms import Term
from simgap.greybox.trial import Trial, significant
from simgap.records import Channels

# Two sets of effects whose scores (log-likelihood, less what the parameters cost) differ by less are not told apart.
CONFOUNDED = 6.0
ENOUGH = 20_000  # samples for a profile; of longer records it is drawn from the excerpts of the selection
PROFILE = (-3.0, -2.0, -1.0, -0.5, 0.5, 1.0, 2.0, 3.0)  # half widths of the 95 % interval


@dataclass(frozen=True)
class Rival:
    """Another effect: the held-out share it would explain, and how far its score stays behind."""

    effect: Effect
    gain: float
    behind: float


@dataclass(frozen=True, eq=False)
class Evidence:
    """The evidence about one plant: what each effect explains, its rivals, its parameters with intervals."""

    identified: Identified
    channels: Channels

    @property
    def selection(self) -> Selection:
        """The selection of effects."""
        return self.identified.selection

    @property
    def explained(self) -> float:
        """Share of the plain model's squared error in training that the effects explain together."""
        return 1 - self.selection.trial.estimate.squares / self.selection.baseline.estimate.squares

    @property
    def found(self) -> bool:
        """Whether there is any effect, bad readings among them."""
        return bool(self.terms or self.selection.baseline.outliers)

    @property
    def terms(self) -> list[Term]:
        """The effects in the order of what they explain."""
        return [term for term, _ in self._in_order]

    @property
    def names(self) -> list[tuple[str, str]]:
        """The effect and the channel of each cause, bad readings first."""
        of_outliers = [Term(OutlierEffect(), outliers.output) for outliers in self.selection.baseline.outliers]
        return [(term.effect.name, self._channel(term)) for term in (*of_outliers, *self.terms)]

    @property
    def shares(self) -> list[float]:
        """Share of the plain model's squared error in training that each takes, on top of those before it."""
        return [share for _, share in self._in_order]

    @cached_property
    def _in_order(self) -> list[tuple[Term, float]]:
        """Every effect with the share of the error that it takes on top of those before it.

        What takes most of the held-out error is next: it is what training has not been fitted to. What has numbers of
        its own in every experiment is fitted to held-out records too, and comes after all that is forecast.
        """
        selection = self.selection
        left, before, listed = list(selection.trial.terms), selection.baseline.estimate.squares, []
        while left:
            known = [term for term, _ in listed]
            next_ones = [term for term in left if not term.effect.own] or left
            fits = selection.each_only([[*known, term] for term in next_ones])
            term, fit = min(zip(next_ones, fits, strict=True), key=lambda pair: float(pair[1].blocks.sum()))
            listed.append((term, (before - fit.estimate.squares) / selection.baseline.estimate.squares))
            left.remove(term)
            before = fit.estimate.squares
        return listed

    @cached_property
    def _intervals(self) -> tuple[np.ndarray, np.ndarray]:
        return intervals(self.identified.plant)

    def causes(self, profiles: bool = False) -> list[Cause]:
        """List the effects in the order of what they explain, with their likelihood profiles if asked for."""
        of_outliers = [self._outlier_cause(outliers) for outliers in self.selection.baseline.outliers]
        return of_outliers + [self._cause(term, share, profiles) for term, share in self._in_order]

    def runners_up(self) -> list[Rival]:
        """List the other effects by themselves, and how far each is behind the best of those chosen by itself."""
        chosen = self.selection.trial
        alone = [r for r in self.selection.rounds if not r.before.terms and len(r.trials) > 1][-1:]
        named = [trial.score for r in alone for trial in r.trials if set(chosen.names) & set(trial.names)]
        return [
            Rival(trial.terms[-1].effect, gained(r.before, trial), max(named) - trial.score)
            for r in alone if named
            for trial in r.trials
            if not set(chosen.names) & set(trial.names)
            and not any(trial.terms[-1].replaces(term) for term in chosen.terms)
        ]  # fmt: skip

    def _cause(self, term: Term, share: float, profiles: bool) -> Cause:
        baseline, chosen, effect = self.selection.baseline, self.selection.trial, term.effect
        without = self.selection.without(term)
        ratio = chosen.train - without.train
        if effect.visible_in_readings:  # and confirmed by plain squares
            ratio = -0.5 * baseline.train.samples * math.log(chosen.estimate.squares / without.estimate.squares)
        values = self._values(term)
        near = [rival for rival in self._rivals(term, without) if rival.behind < CONFOUNDED]
        # A law that contains another one that does as well says no more than that.
        rivals = [one for one in near if not any(other.effect.name in one.effect.contains for other in near)]
        confounded = tuple(separation(effect, rival.effect, baseline.plant.kind) for rival in rivals)
        return Cause(
            effect.name, effect.title, effect.describe({value.name: value.value for value in values}),
            effect.reference, self._channel(term),
            evidence=float(share),
            gain=gained(without, chosen),
            log_likelihood_ratio=ratio,
            parameters=values,
            per_experiment=effect.per_experiment,
            confounded_with=confounded,
            shows_in=effect.shows_in,
            profiles=self._profiles(term) if profiles else (),
            deciding_experiment=deciding_experiment(effect, confounded, baseline.plant.kind),
            output=self._output,
        )  # fmt: skip

    def _outlier_cause(self, outliers: Outliers) -> Cause:
        effect, baseline = OutlierEffect(), self.selection.baseline
        term, samples = Term(effect, outliers.output), baseline.train.samples
        rate, size = baseline.plant.parameters_of(term)
        reach = 1.96 * math.sqrt(outliers.rate * (1 - outliers.rate) / samples)
        wide = 1.96 / math.sqrt(2 * max(1.0, outliers.rate * samples))
        values = (
            Value(rate.name, rate.unit, outliers.rate, max(0.0, outliers.rate - reach), outliers.rate + reach),
            Value(size.name, size.unit, outliers.size, outliers.size * (1 - wide), outliers.size * (1 + wide)),
        )
        return Cause(
            effect.name, effect.title, effect.describe({value.name: value.value for value in values}),
            effect.reference, self._channel(term),
            evidence=outliers.share, gain=outliers.share, log_likelihood_ratio=outliers.log_likelihood_ratio,
            parameters=values, per_experiment=effect.per_experiment, shows_in=effect.shows_in,
            deciding_experiment=deciding_experiment(effect, (), baseline.plant.kind), output=self._output,
        )  # fmt: skip

    def _values(self, term: Term) -> tuple[Value, ...]:
        estimate = self.identified.plant.estimate
        plant, (low, high) = estimate.plant, self._intervals
        parameters = plant.parameters_of(term)
        own: tuple[Value, ...] = ()
        if term in plant.per_experiment:
            sizes = self.identified.plant.sizes_of_own(term)
            spread, smallest, largest = np.sqrt(np.mean(sizes**2)), np.min(sizes), np.max(sizes)
            name = f"{parameters[0].name}, rms over experiments"
            own = (Value(name, parameters[0].unit, float(spread), float(smallest), float(largest)),)
        part = plant.part_of(term)
        rows = zip(plant.common_of(term), estimate.theta[part], low[part], high[part], strict=True)
        shown = [row for row in rows if row[0].told]
        return own + tuple(Value(p.name, p.unit, float(value), float(a), float(b)) for p, value, a, b in shown)

    def _rivals(self, term: Term, without: Trial) -> list[Rival]:
        """What could stand in the place of an effect, the nearest first; the other effects stay."""
        rivals: list[Rival] = []
        # A known machine has many runs, and only what the search came by is compared.
        if self.selection.baseline.plant.machine is not None and not self.selection.has_extended(without):
            return rivals
        for trial in self.selection.extend(without):
            new = [t for t in trial.terms if t not in without.terms]
            other = bool(new) and not new[0].replaces(term) and new[0].effect.name != term.effect.name
            if other and significant(self.selection.baseline, without, trial):
                behind = self.selection.trial.score - trial.score
                rivals.append(Rival(new[0].effect, gained(without, trial), behind))
        return rivals

    @property
    def _output(self) -> str:
        """The first output of the plant; empty where it has all of them."""
        outputs = self.identified.plant.outputs
        return self.channels.outputs[outputs[0]].name if len(outputs) < len(self.channels.outputs) else ""

    def _channel(self, term: Term) -> str:
        """The name of the input or output that an effect sits on; empty for a force."""
        if term.effect.port == "input":
            inputs = self.channels.inputs  # after the last of them, the command of a controller inside
            return inputs[term.channel].name if term.channel < len(inputs) else "controller"
        outputs = self.identified.plant.outputs
        return self.channels.outputs[outputs[term.channel]].name if term.effect.port == "output" else ""

    def _profiles(self, term: Term) -> tuple[Profile, ...]:
        """2 (log L_max - log L) over values of each parameter, everything else fitted anew, of independent errors."""
        fitted, selection = self.identified.plant, self.selection
        estimate, records = fitted.estimate, fitted.records
        if records.samples > ENOUGH or fitted.known_uncertainty is not None:  # or it was fitted to pieces
            estimate, records = selection.trial.estimate, selection.baseline.train
        plant = estimate.plant
        if term not in plant.terms or term in plant.per_experiment:
            return ()
        problem = Problem(plant, records, selection.baseline.noise)
        low, high = self._intervals
        lengths, errors = records.mask.sum(axis=1), np.moveaxis(estimate.errors, 2, 0)
        memory = max(correlation_time(e[records.mask], lengths, 0)[0] for e in errors)
        n = records.samples * plant.ny / memory  # independent errors, as the intervals count them
        profiles = []
        for i, parameter in enumerate(plant.parameters_of(term), start=plant.part_of(term).start):
            half = 0.5 * (high[i] - low[i])
            if parameter.fixed or not half > 0:
                continue
            fixed = np.arange(plant.size) == i
            points = [(float(estimate.theta[i]), 0.0)]
            for step in PROFILE:
                theta = estimate.theta.copy()
                theta[i] = np.clip(theta[i] + step * half, parameter.low, parameter.high)
                fit = descend(problem, theta, estimate.local, fixed=fixed, max_steps=10)
                points.append((float(theta[i]), max(0.0, n * math.log(fit.squares / estimate.squares))))
            values, deviance = zip(*sorted(points), strict=True)
            profiles.append(Profile(parameter.name, parameter.unit, values, deviance))
        return tuple(profiles)


def gained(smaller: Trial, larger: Trial) -> float:
    """Return the share of the held-out squared error that the larger model takes away."""
    return float(1 - larger.blocks.sum() / smaller.blocks.sum())
