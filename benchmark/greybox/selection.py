"""Which effects of the catalogue the data ask for: score test, refits, likelihood and held-out likelihood."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from scipy.stats import chi2

from simgap.greybox.effects.effect import Start
from simgap.greybox.fitting import Estimate, Problem, Records, Slopes, _Normal
from simgap.greybox.linear import block_errors, errors_on, excerpts, let_run_on, plain_models
from simgap.greybox.noise import Noise, log_likelihood, white
from simgap.greybox.outliers import Outliers, find, left_out
from simgap.greybox.plain import refit_from_poles
from simgap.greybox.plant import LOCAL_POWERS, Structure, Term
from simgap.greybox.signal_scales import lattice, scenes_of
from simgap.greybox.trial import Trial, replaces
from simgap.records import Channels, Experiment
from simgap.registry import EFFECTS

T = TypeVar("T")
R = TypeVar("R")

# The chance, over the whole catalogue, that noise alone passes for an effect.
FALSE_NAMES = 1e-3
# What held-out data must add to the log-likelihood: odds of 20 to 1.
HELD_OUT = 3.0
# The mean gain of the held-out blocks over its standard error: one in ten by chance.
CONSISTENT = 1.3
BLOCKS = 20
# Share of the squared error that an effect must explain to be worth a name, however certain it is.
MATTERS = 0.015
MATTERS_AT_ALL = 0.003  # of what the plain model has
# Log-likelihood ratio that confirms what the readings show already.
OBVIOUS = 8.0
# What a linear model of higher order would take up.
LINEAR = ("constant_load", "input_delay", "actuator_lag", "sensor_lag")
# By how much another choice of effects must be better to be preferred to the one that was found first.
BETTER = 1.0
# Two models whose squared errors differ by less fit alike; then the simpler one is taken.
ALIKE = 0.005
MAX_TERMS = 5
# Steps of a search until the candidates of a round are compared, and for those that are then left.
FEW_STEPS = 6
MAX_STEPS = 40
FINALISTS = 8
MAX_NOISE_ORDER = 3
STARTS = 2
# Score tests below this log-likelihood ratio are not worth a refit.
WORTH_A_REFIT = 2.0
DELAY = Term(EFFECTS["input_delay"]())


@dataclass
class Search:
    """The effects that explain one output (or a position with its velocity) of a training set.

    `path` holds the models of increasing size, `rivals` what else was tried in each round.
    """

    train: Records
    valid: Records
    channels: Channels
    outputs: tuple[int, ...]
    structure: Structure
    plain: Estimate
    cut: bool = False  # long records were cut in pieces, so that nothing can be said of single experiments
    outliers: list[Outliers] = field(default_factory=list)  # found in the readings, and left out of both records
    threads: int = 2
    noise_order: int = 0
    path: list[Trial] = field(default_factory=list)
    rounds: list[tuple[Trial, list[Trial]]] = field(default_factory=list)
    _tried: dict[Any, list[Trial]] = field(default_factory=dict, repr=False)

    @classmethod
    def of(
        cls, train: Sequence[Experiment], valid: Sequence[Experiment], channels: Channels, outputs: Sequence[int]
    ) -> Search:
        """Fit the plain model of the outputs' kind."""
        records = Records.of(excerpts(train), outputs)
        held_out = Records.of(excerpts(valid), outputs) if valid else records
        cut = len(records.u) > len(train) or records.mask.shape[1] < max(map(len, train))
        kind = channels.outputs[outputs[0]].kind
        tried = plain_models(records, held_out, kind)
        off = (
            find(tried[-1].errors, records.mask)
            if not any(lattice(records.y[..., j]) for j in range(len(outputs)))
            else []
        )
        if off:
            records = left_out(records, tried[-1].errors, off)
            held_out = left_out(held_out, errors_on(tried[-1], held_out), off) if valid else records
            tried = plain_models(records, held_out, kind)

        def started(plain: Estimate) -> Search:
            problem = Problem(plain.structure, records, white(np.ones(plain.structure.ny)))
            structure = replace(plain.structure, scenes=scenes_of(plain, problem, channels, outputs))
            plain = replace(plain, structure=structure)
            return cls(records, held_out, channels, tuple(outputs), structure, plain, cut, off)

        search = started(tried[-1])
        to_beat = search.held_out_error(search.plain)
        for simpler in (fit for fit in tried[:-1] if not fit.structure.zeros):
            # A higher order is no answer where a delay or another law of the plant, which cost no more, do as well.
            other = started(simpler)
            if any(other.held_out_error(other.add(other.plain, term)) <= to_beat
                   for term in (DELAY, *other.laws())):  # fmt: skip
                search = other
                break
        smooth = let_run_on(search.plain, records, held_out)
        return search if smooth is None else started(smooth)

    def laws(self) -> list[Term]:
        """The effects that change the law of the plant itself, such as an outflow that is not linear in the level."""
        return [term for term in self.candidates(()) if term.effect.reshapes and term.effect.port == "force"]

    def held_out_error(self, fit: Estimate) -> float:
        """Mean square of held-out simulations."""
        return float(block_errors(fit, self.valid).mean())

    # ------------------------------------------------------------------ one model

    @cached_property
    def base_noise(self) -> Noise:
        """White noise as large as the errors of the plain model; weighs the outputs against each other."""
        return white(np.sqrt(np.mean(self.plain.errors[self.train.mask] ** 2, axis=0)) + 1e-300)

    @cached_property
    def plain_squares(self) -> float:
        """The squares of the plain model, weighed as those of all others."""
        return Problem(self.plain.structure, self.train, self.base_noise).squares(self.plain.errors)

    def assess(self, found: Estimate) -> Trial:
        """Score a fitted model on training and on held-out data."""
        structure = found.structure
        held_out = Problem(structure, self.valid, self.base_noise)
        fixed = np.ones(structure.size, dtype=bool)
        on_valid = held_out.fit(found.theta, fixed=fixed, max_steps=10)
        return Trial(
            structure.terms, found,
            log_likelihood(found.errors, self.train.mask, self.noise_order),
            log_likelihood(on_valid.errors, self.valid.mask, self.noise_order),
            int(structure.free.sum()), len(self.train.u) * len(structure.local),
            len(self.valid.u) * len(structure.local),
            self._blocks(on_valid.errors),
        )  # fmt: skip

    def _blocks(self, errors: np.ndarray) -> np.ndarray:
        white = np.where(self.valid.mask[:, :, None], self.base_noise.whiten(errors), 0.0)
        per_record = max(2, BLOCKS // len(white))
        return np.concatenate([block.sum(axis=(1, 2)) for block in np.array_split(white**2, per_record, axis=1)])

    def fit(
        self, terms: Sequence[Term], starts: Iterable[tuple[np.ndarray, np.ndarray]], max_steps: int = MAX_STEPS
    ) -> Estimate:
        """The best fit of a set of terms from several starts."""
        problem = Problem(self.structure.having(terms), self.train, self.base_noise)
        return min((problem.fit(*start, max_steps=max_steps) for start in starts), key=lambda fit: fit.squares)

    def add(self, here: Estimate, term: Term) -> Estimate:
        """The model with one term more, whatever the score test says of it."""
        problem = Problem(here.structure, self.train, self.base_noise)
        slopes = problem.slopes(here.theta, here.local, here.structure.free)
        found = self.extend(here, term, slopes)
        if found is not None:
            return found
        structure = self.structure.having([*here.structure.terms, term])
        return self.fit(structure.terms, [self.carry(here, structure, term, s) for s in structure.starts_of(term)])

    # ------------------------------------------------------------------ one round

    def candidates(self, here: Sequence[Term]) -> list[Term]:
        """Every effect that suits the machine and is not in the model, on every channel."""
        taken = {term.key for term in here}
        names = {term.effect.name for term in here}
        found = []
        for name in EFFECTS.names():
            effect = EFFECTS[name]()
            if name == "outliers" or (name == "coulomb_friction" and "stribeck_friction" in names):
                continue
            channels = {"input": self.structure.nu, "force": 1, "output": self.structure.ny}[effect.port]
            if name in LOCAL_POWERS and self.cut:
                continue
            terms = [Term(effect, channel) for channel in range(channels)]
            found += [t for t in terms if t.key not in taken and effect.suits(self.structure.scenes.of(t))]
        return found

    def extend(self, here: Estimate, term: Term, slopes: Slopes, max_steps: int = MAX_STEPS) -> Estimate | None:
        """The model with one term more, fitted from the starts that the score test likes best; None if none does."""
        terms = [t for t in here.structure.terms if not replaces(term, t)]
        structure = self.structure.having([*terms, term])
        if term in structure.local:
            return self.fit(structure.terms, [self.carry(here, structure, term, None)])
        if term.effect.reshapes:
            starts = [self.carry(here, structure, term, start)[0] for start in structure.starts_of(term)]
            return refit_from_poles(Problem(structure, self.train, self.base_noise), starts)
        scored = sorted(self.screen(here, structure, term, slopes), key=lambda pair: -pair[0])
        if not scored:
            return None
        if scored[0][0] < WORTH_A_REFIT:
            return None
        starts = [self.carry(here, structure, term, start) for _, start in scored[:STARTS]]
        return self.fit(structure.terms, starts, max_steps)

    def carry(
        self, here: Estimate, structure: Structure, term: Term, start: Start | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Theta and local numbers of a smaller model, as the start of a larger one."""
        theta = np.zeros(structure.size)
        theta[: structure.n_plant] = here.theta[: structure.n_plant]
        local = np.zeros((len(here.local), structure.n_local))
        local[:, : structure.order] = here.local[:, : structure.order]
        for other in structure.terms:
            if other == term or other not in here.structure.terms:
                continue
            if other in structure.local:
                at = structure.order + structure.local.index(other)
                local[:, at] = here.local[:, structure.order + here.structure.local.index(other)]
            else:
                theta[structure.term_at(other)] = here.theta[here.structure.term_at(other)]
        if start is not None:
            theta[structure.term_at(term)] = start.values
        return theta, local

    def screen(self, here: Estimate, structure: Structure, term: Term, slopes: Slopes) -> list[tuple[float, Start]]:
        """Score test of each start: the log-likelihood that the step in the simulation would gain, to first order.

        d = simulation with the effect less simulation without, made orthogonal to the model's own slopes;
        gain = -N/2 log(1 - (d' e)^2 / (d' d  e' e)). Where d grows in proportion to a parameter, the start moves there.
        """
        noise = self.base_noise
        base = Problem(here.structure, self.train, noise)
        extended = Problem(structure, self.train, noise)
        e = noise.whiten(here.errors).reshape(len(here.local), -1)
        ee = float(np.vdot(e, e))
        simulated = base.simulator.run(here.theta, here.local)
        n = self.train.samples * structure.ny
        scored = []
        for start in structure.starts_of(term):
            theta, local = self.carry(here, structure, term, start)
            d = extended.simulator.run(theta, local) - simulated
            d = noise.whiten(d * self.train.weights).reshape(e.shape)
            if not np.isfinite(d).all() or not d.any():
                scored.append((0.0, start))
                continue
            _, projected = _Normal.of(slopes, d).step(here.structure.free, 1e-9)
            dd = float(np.vdot(d, d))
            rest = max(dd - projected, 1e-6 * dd)
            along = float(np.vdot(d, e))
            if along < 0 and start.amplitude is None:
                scored.append((0.0, start))
                continue
            gain = -0.5 * n * math.log(max(1 - along * along / (rest * ee), 1e-12))
            values = list(start.values)
            if start.amplitude is not None:
                parameter = structure.parameters_of(term)[start.amplitude]
                moved = values[start.amplitude] * along / rest
                values[start.amplitude] = float(np.clip(moved, parameter.low, parameter.high))
            scored.append((gain, Start(tuple(values), start.amplitude)))
        return scored

    def round(self, here: Estimate, names: Sequence[str] = ()) -> list[Trial]:
        """Every candidate (of those named) added to a model, refitted and assessed; the best first."""
        key = (frozenset(term.key for term in here.structure.terms), tuple(names))
        if key in self._tried:
            return self._rank([self._again(trial) for trial in self._tried[key]])
        problem = Problem(here.structure, self.train, self.base_noise)
        slopes = problem.slopes(here.theta, here.local, here.structure.free)
        terms = [t for t in self.candidates(here.structure.terms) if not names or t.effect.name in names]

        def attempt(term: Term) -> Estimate | None:
            return self.extend(here, term, slopes, FEW_STEPS)

        before = problem.squares(here.errors)
        n = self.train.samples * self.structure.ny

        def finish(fit: Estimate) -> Trial:
            hopeless = 0.5 * n * math.log(before / fit.squares) < WORTH_A_REFIT and not fit.structure.local
            done = fit.converged or hopeless
            return self.assess(fit if done else self.fit(fit.structure.terms, [(fit.theta, fit.local)]))

        begun = sorted((fit for fit in self._map(attempt, terms) if fit is not None), key=self._cost)
        self._tried[key] = self._map(finish, begun[:FINALISTS])
        return self._rank(self._tried[key])

    def _map(self, work: Callable[[T], R], items: Sequence[T]) -> list[R]:
        if self.threads < 2:
            return list(map(work, items))
        with ThreadPoolExecutor(self.threads) as pool:
            return list(pool.map(work, items))

    def _cost(self, fit: Estimate) -> float:
        """Squares and the number of parameters on one scale, for candidates of one round."""
        n = self.train.samples * self.structure.ny
        price = int(fit.structure.free.sum()) + len(fit.local) * len(fit.structure.local)
        return 0.5 * n * math.log(fit.squares) + 0.5 * price * math.log(n)

    def _rank(self, trials: list[Trial]) -> list[Trial]:
        """The best first; but of those that fit alike, the one with the fewest parameters."""
        ranked = sorted(trials, key=lambda trial: -trial.score)
        if not ranked:
            return ranked
        alike = [t for t in ranked if t.estimate.squares < (1 + ALIKE) * ranked[0].estimate.squares]
        simplest = min(alike, key=lambda trial: trial.k + trial.k_train)
        if simplest.k + simplest.k_train == ranked[0].k + ranked[0].k_train:
            return ranked
        return [simplest, *(trial for trial in ranked if trial is not simplest)]

    # ------------------------------------------------------------------ the whole search

    def run(self) -> Search:
        """What the readings show, what a linear model needs more, then everything; and out again what was in vain."""
        here = self.look(self.assess(self.plain))
        here = self.grow(here, LINEAR)
        here = self.grow(here)
        here = self.prune(here)
        self.path.append(self.exchange(here))
        return self

    def grow(self, here: Trial, names: Sequence[str] = ()) -> Trial:
        """Add the best effect (of those named) while noise alone would not do as well."""
        while len(here.terms) < MAX_TERMS:
            trials = self.round(here.estimate, names)
            if trials:
                self._choose_noise_order(min(trials, key=lambda trial: trial.estimate.squares).estimate)
                here, trials = self._again(here), self._rank([self._again(trial) for trial in trials])
            self.rounds.append((here, trials))
            better = [trial for trial in trials if self.significant(here, trial)]
            if not better:
                break
            here = better[0]
            self.path.append(here)
        return here

    def prune(self, here: Trial) -> Trial:
        """Take out, one by one, the effects that the others have made superfluous."""
        while len(here.terms) > 1:
            rest = [self.without(here, term) for term in here.terms if not term.effect.obvious]
            needless = [trial for trial in rest if not self.significant(trial, here)]
            if not needless:
                break
            here = max(needless, key=lambda trial: trial.score)
        return here

    def without(self, here: Trial, term: Term) -> Trial:
        """The model with one term less, fitted again."""
        structure = self.structure.having([other for other in here.terms if other != term])
        return self.assess(self.fit(structure.terms, [self.carry(here.estimate, structure, term, None)]))

    def exchange(self, here: Trial) -> Trial:
        """Try every other effect in the place of each, because the first choice was made without the others."""
        for term in here.terms if len(here.terms) > 1 else ():
            if term not in here.terms or term.effect.obvious:
                continue
            rest = self.without(here, term)
            trials = [trial for trial in self.round(rest.estimate) if self.significant(rest, trial)]
            if trials and trials[0].score > here.score + BETTER:
                here = self.prune(trials[0])
        return here

    def look(self, here: Trial) -> Trial:
        """What the readings themselves show, before the errors of any model are asked."""
        self.path = [here]
        slopes = Slopes(np.zeros((0, 0, 0)), np.zeros((0, 0, 0)))
        for term in self.candidates(()):
            if term.effect.obvious:
                fit = self.extend(here.estimate, term, slopes)
                trial = self.assess(fit) if fit is not None else here
                if trial.train - here.train > OBVIOUS and self.holds_out(here, trial):
                    here = trial
                    self.path.append(here)
        return here

    def losses(self, here: Trial) -> list[tuple[Term, Trial]]:
        """Every effect of a model with the model that does without it, the most missed first."""
        rest = [(term, self.without(here, term)) for term in here.terms]
        return sorted(rest, key=lambda pair: -pair[1].estimate.squares)

    def _again(self, trial: Trial) -> Trial:
        return self.assess(trial.estimate)

    def _choose_noise_order(self, best: Estimate) -> None:
        """The memory of the errors of the best model, by Schwarz' criterion."""
        n = self.train.samples
        values = [
            log_likelihood(best.errors, self.train.mask, order) - 0.5 * order * self.structure.ny * math.log(n)
            for order in range(MAX_NOISE_ORDER + 1)
        ]
        self.noise_order = int(np.argmax(values))

    def significant(self, smaller: Trial, larger: Trial) -> bool:
        """Whether the larger model says more than noise would make it say, in training data and in held-out data."""
        ratio = larger.train - smaller.train
        extra = max(1, larger.k - smaller.k + larger.k_train - smaller.k_train)
        tried = len(self.candidates(smaller.terms)) * STARTS
        chance = chi2.sf(max(0.0, 2 * ratio), extra) * tried
        gain = smaller.estimate.squares - larger.estimate.squares
        matters = gain > MATTERS * smaller.estimate.squares and gain > MATTERS_AT_ALL * self.plain_squares
        return bool(matters and chance < FALSE_NAMES and self.holds_out(smaller, larger))

    def holds_out(self, smaller: Trial, larger: Trial) -> bool:
        """Whether the larger model simulates held-out data better, in most of them."""
        if larger.k_valid > smaller.k_valid:
            # Estimated anew there, so the gain must pay for that.
            price = 0.5 * (larger.k_valid - smaller.k_valid) * math.log(self.valid.mask.shape[1])
            return larger.valid - smaller.valid - price > HELD_OUT
        gain = smaller.blocks - larger.blocks
        return bool(gain.mean() > CONSISTENT * gain.std() / math.sqrt(len(gain)))
