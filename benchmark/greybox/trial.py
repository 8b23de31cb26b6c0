"""One set of effects, fitted and judged: likelihoods, held-out errors, and whether one set is better than another."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from scipy.stats import chi2

from simgap.cores import on_cores
from simgap.error_views.correlation import correlation_time
from simgap.greybox.baseline import TOLERANCE, Baseline
from simgap.greybox.fitting import Estimate, descend
from simgap.greybox.held_out import detrended, gain_later, in_most, on_other_records, squares_of_blocks
from simgap.greybox.noise import explained_by_past, log_likelihood, schwarz_order
from simgap.greybox.problem import Problem
from simgap.greybox.samples import PIECE, Records
from simgap.greybox.score_test import STARTS, candidates
from simgap.greybox.terms import Term

# The chance, over the whole catalogue, that noise alone passes for an effect.
FALSE_NAMES = 1e-3
WAYS = 2  # in which an effect may pass: by one-step errors and by free runs
# What held-out data must add to the log-likelihood: odds of 20 to 1.
HELD_OUT = 3.0
CONSISTENT = 1.3
# Standard deviation of the size of what repeats itself, over its mean; of a swing that chance excites it is 0.52, its
# amplitude being distributed as Rayleigh found.
UNEQUAL = 0.25
WORST = 10.0  # times the squares of the mean model: what the error of a held-out block counts at most
# Share of the squared error that an effect must explain to be worth a name, however certain it is.
MATTERS = 0.015
MATTERS_AT_ALL = 0.003  # of what the plain model has
# Share of what the errors before them explain of the errors: what an effect beside others must take. Such errors may be
# the trace of something that is no candidate, and a wrong effect takes a part of them.
OF_MEMORY = 0.25
# Of the squared error that another model leaves of each half of the training records, fitted to the other half: what a
# model leaves that is better, whatever a held-out record says that hardly tells the two apart.
HALVES_LEAVE = 0.5
PIECES_LEAVE = 0.25  # where whole held-out records speak against it, and only pieces of them for it
FEW_STEPS = 10  # from the fit to all records to that of a half
# Two models whose squared errors differ by less fit alike; then the simpler one is taken.
ALIKE = 0.005


@dataclass(frozen=True, eq=False)
class Trial:
    """One set of terms, fitted: log-likelihoods of training and held-out errors, and the parameters they cost."""

    terms: tuple[Term, ...]
    estimate: Estimate
    records: Records  # of training
    train: float
    valid: float
    k: int  # parameters estimated for all experiments
    own: int  # numbers of every experiment that belong to terms of its own
    k_train: int  # parameters of single training experiments: those, and where what terms remember begins
    k_valid: int
    memory: float  # share of the squared training errors that the errors before them explain
    blocks: np.ndarray  # held-out squares over the variance of the plain model, block by block
    detrended: np.ndarray  # the same, where a straight line in each record counts for nothing

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the effects."""
        return tuple(term.effect.name for term in self.terms)

    @property
    def cost(self) -> int:
        """Parameters that were estimated in training."""
        return self.k + self.k_train

    @property
    def score(self) -> float:
        """Log-likelihood of all data less what its parameters cost (Schwarz 1978 for those of all experiments)."""
        of_all, of_one = 0.5 * math.log(self.records.samples), 0.5 * math.log(self.records.usual_length)
        return self.train + self.valid - self.k * of_all - (self.k_train + self.k_valid) * of_one


def assess(baseline: Baseline, estimate: Estimate, noise_order: int) -> Trial:
    """Score a fitted model on training and on held-out data, under autoregressive noise of the given order."""
    plant, valid = estimate.plant, baseline.valid
    problem = Problem(plant, valid, baseline.noise)
    on_valid = on_other_records(problem, estimate.theta)
    return Trial(
        plant.terms, estimate, baseline.train,
        log_likelihood(estimate.errors, baseline.train.mask, noise_order, baseline.resolution),
        log_likelihood(on_valid.errors, valid.mask, noise_order, baseline.resolution),
        int(plant.free.sum()), plant.n_own, len(baseline.train.u) * plant.n_of_terms, len(valid.u) * plant.n_of_terms,
        explained_by_past(estimate.errors, baseline.train.mask),
        squares_of_blocks(problem, on_valid.errors),
        squares_of_blocks(problem, detrended(on_valid.errors, valid.mask)),
    )  # fmt: skip


def judged(
    baseline: Baseline, before: Trial, fits: Sequence[Estimate], noise_order: int
) -> tuple[int, Trial, tuple[Trial, ...]]:
    """Assess models with one effect more, the best first, and the one before them, under the noise of the best.

    A known machine keeps the noise order: its many free runs judge, not the next sample.
    """
    if fits and baseline.plant.machine is None:
        best = min(fits, key=lambda fit: fit.squares)
        noise_order = schwarz_order(best.errors, baseline.train.mask, baseline.resolution)
        before = assess(baseline, before.estimate, noise_order)
    return noise_order, before, tuple(assessed(baseline, fits, noise_order))


def assessed(baseline: Baseline, fits: Sequence[Estimate], noise_order: int) -> list[Trial]:
    """Assess several models, the best first."""
    return ranked(on_cores(partial(assess, baseline, noise_order=noise_order), fits))


def score_gain(one: Baseline, estimate: Estimate, other: Baseline, without: Estimate) -> float:
    """Score of one model less that of another, under noise of one memory: that of the more demanding one."""
    fits, train = (estimate, without), one.train
    order = max(schwarz_order(fit.errors, train.mask, train.resolution) for fit in fits)
    scores = [assess(baseline, fit, order).score for baseline, fit in zip((one, other), fits, strict=True)]
    return scores[0] - scores[1]


def significant(baseline: Baseline, smaller: Trial, larger: Trial) -> bool:
    """Tell whether the larger model says more than noise would make it say, in training and in held-out data."""
    return beyond_chance(baseline, smaller, larger) and holds_out(baseline, smaller, larger)


def beyond_chance(baseline: Baseline, smaller: Trial, larger: Trial) -> bool:
    """Tell whether the larger model says more of the training data than noise would make it say, and enough.

    2 log(L_larger / L_smaller) ~ chi2(extra parameters) under noise alone (Wilks 1938), times the number tried. L is
    that of one-step errors, or of free runs: an effect may take most of what is wrong in the long run and leave the
    next sample as hard to forecast as it was.
    """
    ratio = max(larger.train - smaller.train, free_run_ratio(baseline, smaller, larger))
    extra = max(1, larger.k - smaller.k + larger.k_train - smaller.k_train)
    tried = len(candidates(baseline, smaller.terms)) * STARTS
    chance = chi2.sf(max(0.0, 2 * ratio), extra) * tried * WAYS
    return bool(chance < FALSE_NAMES and _matters(baseline, smaller, larger))


def _matters(baseline: Baseline, smaller: Trial, larger: Trial) -> bool:
    """Tell whether an effect takes enough of the squared errors to be worth a name.

    Beside other effects it must also take its share of errors with memory: of free runs in training, of held-out ones
    if nothing is estimated anew there, or of one-step errors.
    """
    before, gain = smaller.estimate.squares, smaller.estimate.squares - larger.estimate.squares
    if not (gain > MATTERS * before and gain > MATTERS_AT_ALL * baseline.estimate.squares):
        return False
    held_out = 1.0 - larger.blocks.sum() / smaller.blocks.sum() if larger.own == smaller.own else 0.0
    of_one_step = 1.0 - math.exp(-2.0 * max(0.0, larger.train - smaller.train) / baseline.n_errors)
    return not smaller.terms or bool(max(gain / before, held_out, of_one_step) > OF_MEMORY * larger.memory)


def free_run_ratio(baseline: Baseline, smaller: Trial, larger: Trial) -> float:
    """Compute log(L_larger / L_smaller) of the free-run errors in training, counted in independent samples.

        sum over outputs of N / (2 tau) log(s_smaller^2 / s_larger^2)

    tau is the time over which the errors of the larger model remember themselves (Bartlett 1946).
    """
    mask, ratio = baseline.train.mask, 0.0
    for j in range(baseline.plant.ny):
        before, after = (trial.estimate.errors[..., j][mask] for trial in (smaller, larger))
        tau, _ = correlation_time(after, mask.sum(axis=1), 0)
        least = len(after) * baseline.resolution[j] ** 2
        ratio += 0.5 * len(after) / tau * math.log(max(before @ before, least) / max(after @ after, least))
    return ratio


def holds_out(baseline: Baseline, smaller: Trial, larger: Trial) -> bool:
    """Tell whether the larger model simulates held-out data better, in most of them."""
    if larger.own > smaller.own:
        # Estimated anew there, so the gain must pay for that; and so in training, counted in independent samples:
        # a line through what wanders slowly seems certain, but takes little of it (Durlauf and Phillips 1988).
        price = 0.5 * (larger.k_valid - smaller.k_valid) * math.log(baseline.valid.usual_length)
        paid = 0.5 * (larger.k_train - smaller.k_train) * math.log(baseline.train.usual_length)
        straight = free_run_ratio(baseline, smaller, larger) > paid
        held_out = larger.valid - smaller.valid - price > HELD_OUT
        return straight and held_out and all(_goes_on(baseline, smaller, larger, term) for term in larger.terms)
    # One simulation that grows without bound must not outweigh all other blocks.
    most = WORST * baseline.blocks_of_mean.mean()
    gain = np.minimum(smaller.blocks, most) - np.minimum(larger.blocks, most)
    # Runs of many conditions: an effect that acts in some of them only must gain in the mean, by more than chance.
    of_many = baseline.plant.machine is not None and gain.mean() > CONSISTENT * gain.std() / math.sqrt(len(gain))
    if of_many or in_most(gain):
        return True
    if baseline.plant.machine is not None:
        return False
    # Where errors stay, a drift of the sensor or a small force becomes a trend of the free run. Drifts are looked for
    # last, and must not speak against what is looked for before them.
    if baseline.repeated and baseline.keeps_errors:
        but_lines = np.minimum(smaller.detrended, most) - np.minimum(larger.detrended, most)
        if in_most(but_lines):
            return True
    fits = larger.estimate, smaller.estimate
    if gain.mean() > 0:
        return halves_speak_for(baseline, *fits)
    return pieces_speak_for(baseline, *fits) and halves_speak_for(baseline, *fits, PIECES_LEAVE)


def _goes_on(baseline: Baseline, smaller: Trial, larger: Trial, term: Term) -> bool:
    """Tell whether what should repeat itself does: on from the first half of held-out records, as large in all of them.

    A swing of the machine that its inputs excite is not.
    """
    if not term.effect.repeats or term in smaller.terms:
        return True
    fit, plant = larger.estimate, larger.estimate.plant
    held_out = on_other_records(Problem(plant, baseline.valid, baseline.noise), fit.theta)
    own = np.concatenate((fit.local, held_out.local))[:, plant.own_part_of(term)]
    sizes = np.linalg.norm(own, axis=1)
    as_large = sizes.std() < UNEQUAL * sizes.mean()
    return bool(as_large) and in_most(gain_later(baseline.valid, baseline.noise, smaller.estimate, fit))


def pieces_speak_for(baseline: Baseline, one: Estimate, other: Estimate) -> bool:
    """Tell whether one model errs less than the other in most pieces of the held-out records, after all.

    Over a whole record, a plant that integrates carries the least offset away from the readings, and a cause that is
    right speaks against itself until the others are found. Where training records were cut, pieces as long as those
    may be asked.
    """
    if not has_pieces(baseline):
        return False
    of_one, of_other = (squares_in_pieces(baseline, fit) for fit in (one, other))
    return in_most(of_other - of_one)


def has_pieces(baseline: Baseline) -> bool:
    """Tell whether the training records were cut and held-out ones are long enough for pieces of that length."""
    return baseline.cut and baseline.valid.mask.shape[1] >= 2 * PIECE


@lru_cache(maxsize=100)
def squares_in_pieces(baseline: Baseline, estimate: Estimate) -> np.ndarray:
    """Sum the squares of held-out pieces, each from the start that suits it best, block by block."""
    problem = Problem(estimate.plant, baseline.valid.pieces(PIECE), baseline.noise)
    return squares_of_blocks(problem, on_other_records(problem, estimate.theta).errors)


def halves_speak_for(baseline: Baseline, one: Estimate, other: Estimate, most: float = HALVES_LEAVE) -> bool:
    """Tell whether one model leaves less than `most` of the other's error of each half of the training records.

    Both are fitted to the other half. Held-out records may tell little, one that stands still for most of its time.
    """
    left, of_other = (squares_crosswise(baseline, fit) for fit in (one, other))
    return bool(left.sum() < most * of_other.sum()) and in_most(of_other - left)


@lru_cache(maxsize=100)
def squares_crosswise(baseline: Baseline, estimate: Estimate) -> np.ndarray:
    """Sum the squares, block by block, of each half of the training records by the model fitted to the other half."""
    halves = [Problem(estimate.plant, half, baseline.noise) for half in baseline.train.halves()]
    found = []
    for ours, others in (halves, halves[::-1]):
        # From the states that suit it: from rest, the first step may lead away from where the fit to all ended.
        start = on_other_records(ours, estimate.theta).local
        fit = descend(ours, estimate.theta, start, max_steps=FEW_STEPS, tolerance=TOLERANCE)
        found.append(squares_of_blocks(others, on_other_records(others, fit.theta).errors))
    return np.concatenate(found)


def ranked(trials: list[Trial]) -> list[Trial]:
    """Sort trials, the best first; but of those that fit alike, the one with the fewest parameters."""
    best_first = sorted(trials, key=lambda trial: -trial.score)
    if not best_first:
        return []
    best = best_first[0]
    alike = [trial for trial in best_first if trial.estimate.squares < (1 + ALIKE) * best.estimate.squares]
    simplest = min(alike, key=lambda trial: trial.cost)
    if simplest.cost == best.cost:
        return best_first
    return [simplest, *(trial for trial in best_first if trial is not simplest)]
