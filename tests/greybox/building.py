"""Every object of the package that the tests of this folder need is made here, and every call of it goes through here.

Arrays go in and come out; what is opaque (a search, a term, a trial) is only handed on to another function of this
file. So a change of names or places in the package changes this file alone.
"""

from dataclasses import replace
from unittest.mock import patch

import numpy as np

from simgap.greybox import leftover as _leftover
from simgap.greybox import linear
from simgap.greybox import samples as _samples
from simgap.greybox.additions import add, with_any_more
from simgap.greybox.evidence import Evidence
from simgap.greybox.fitting import Estimate
from simgap.greybox.held_out import detrended as _detrended
from simgap.greybox.identification import Identified, identify
from simgap.greybox.intervals import intervals
from simgap.greybox.model import FittedPlant
from simgap.greybox.refits import refine
from simgap.greybox.samples import Records
from simgap.greybox.score_test import candidates as _candidates
from simgap.greybox.score_test import score_tests
from simgap.greybox.search import Search, passes
from simgap.greybox.selection import Selection, select
from simgap.greybox.trial import Trial, assess, assessed, squares_crosswise
from simgap.greybox.trial import ranked as _ranked
from simgap.greybox.trial import significant as _significant

from .parts import channels, records, term

# ------------------------------------------------------------------ search


def plain_search(train, valid, kind, ny=1):
    """A search with its plain model, before any effect was tried."""
    return linear.find_baseline(train, valid, channels(kind, ny), tuple(range(ny)), 10)


def candidates(search, *present):
    """Names of the effects that could be added to a model with these."""
    return [t.effect.name for t in _candidates(search, [term(name) for name in present])]


def of_single_experiments(search):
    """Names of those with numbers of their own in each experiment."""
    return {t.effect.name for t in _candidates(search, []) if t.effect.per_experiment}


def cut_in_pieces(search):
    """The same search on records that are only pieces of experiments."""
    return replace(search, cut=True)


def scores_of(search, name):
    """The score test of every start of an effect: gain of log-likelihood, and the values that it moves to."""
    plain, added = search.estimate, term(name)
    plant = search.plant.having([added])
    scored = score_tests(search, plain, [added])[0]
    return [(gain, tuple(theta[plant.part_of(added)])) for gain, theta, _ in scored]


def score_of(search, name):
    """The best of them."""
    return max(scores_of(search, name))


def plain_errors(search):
    """Training errors of the plain model, of all measured samples: [N, ny]."""
    return search.estimate.errors[search.train.mask]


def gain_of_refit(search, name):
    """Half of N times the fall of the log of the squared errors, when the package fits the effect along."""
    found = add(search, search.estimate, term(name))
    after = found.errors[search.train.mask]
    return 0.5 * after.size * np.log(search.estimate.squares / found.squares)


def with_effects(search, *names):
    """The assessed model with these effects, fitted one after the other."""
    found = search.estimate
    for name in names:
        found = add(search, found, term(name))
    return assess(search, found, 0)


def refined(search, name):
    """The fit with this effect, of the form that has more numbers."""
    return refine(search, add(search, search.estimate, term(name)), term(name))


def added_where_free_runs_need(search, together):
    """The effects that a search adds where free runs get better with so many of them, and not with fewer."""
    with patch("simgap.greybox.trial.holds_out", lambda _, smaller, larger: len(larger.terms) >= together):
        return Search(search).forward(assess(search, search.estimate, 0), "forecast").names


def best_of_round(search):
    """The plain model and the best of all its extensions by one effect."""
    fits = with_any_more(search, search.estimate, {})
    return assess(search, search.estimate, 0), assessed(search, fits, 0)[0]


def added_to(search, squares, remembered):
    """Models with one effect more than the plain one, as if its fit had so many times its squares."""
    fit = replace(search.estimate, squares=squares * search.estimate.squares)
    return with_any_more(search, fit, remembered)


def names_of(trial):
    """The effects of a trial."""
    return trial.names


def sizes_of(trial):
    """Effect -> its fitted parameters, of a trial."""
    plant = trial.estimate.plant
    return {t.effect.name: trial.estimate.theta[plant.part_of(t)] for t in trial.terms}


def pruned(search, trial):
    """What is left of a trial's effects without the superfluous ones."""
    return Search(search).backward(trial).names


def without_each(search, trial):
    """Squared errors without each effect of a pruned trial: as pruning left them, and fitted anew."""
    pruning = Search(search)
    trial = pruning.backward(trial)
    chosen = Selection(search, trial, pruning.noise_order, (), {}, dict(pruning.parts))
    anew = replace(chosen, parts={})
    return [
        [selection.without(missing).estimate.squares for missing in trial.terms] for selection in (chosen, anew)
    ], len(chosen.parts)


def passing_alone(training):
    """The effects that are selected; each must pass against the others in the last model."""
    found = set()
    for identified in identify(training):
        selection = identified.selection
        for missing in selection.trial.terms:
            assert passes(selection.baseline, missing, selection.without(missing), selection.trial)
        found |= set(selection.trial.names)
    return found


def in_order(search, trial):
    """The effects of a trial in the order of a diagnosis."""
    fitted = FittedPlant(trial.estimate, search.noise, search.outputs, search.train, ())
    evidence = Evidence(Identified(Selection(search, trial, 0, (), {}), fitted), channels("position"))
    return [t.effect.name for t, _ in evidence._in_order]


# ------------------------------------------------------------------ trials


def trial(
    search, squares=1.0, log_likelihood=0.0, parameters=1, own=0, held_out=None, held_out_gain=0.0, own_there=0,
    effects=(), memory=0.0, but_lines=None,
):  # fmt: skip
    """A trial of hand-made numbers.

    `squares` of the plain model's; `own` and `own_there` count numbers of single experiments in training and held-out
    data; `held_out` are the squares of held-out blocks, `held_out_gain` the log-likelihood of held-out data, `memory`
    the share of the errors that the errors before them explain, `but_lines` the squares of held-out blocks where a
    straight line in each record counts for nothing.
    """
    estimate = replace(search.estimate, squares=squares * search.estimate.squares)
    blocks, detrended = (np.ones(20) if it is None else np.asarray(it, dtype=float) for it in (held_out, but_lines))
    likelihoods = float(log_likelihood), float(held_out_gain)
    terms = tuple(term(name) for name in effects)
    numbers = parameters, int(own_there > 0), own, own_there
    return Trial(terms, estimate, search.train, *likelihoods, *numbers, memory, blocks, detrended)


def by_the_other_half(search, trial):
    """The squares of training errors, block by block, each half forecast by what was fitted to the other."""
    return squares_crosswise(search, trial.estimate)


def detrended(errors, mask):
    """Errors without the straight line of each record."""
    return _detrended(errors, mask)


def score_of_trial(made):
    """Log-likelihood less what the parameters cost."""
    return made.score


def significant(search, smaller, larger):
    """Whether the larger trial is to be believed."""
    return _significant(search, smaller, larger)


def ranked(search, trials):
    """The trials, best first."""
    return _ranked(trials)


def chances(search):
    """How many starts of effects noise could pass for one with."""
    return 2 * len(_candidates(search))


def samples_held_out(search):
    """Samples of the longest held-out record."""
    return search.valid.mask.shape[1]


# ------------------------------------------------------------------ plain models


def order_of(search):
    """The order of the plain plant."""
    return search.plant.order


def orders_tried(train, valid, kind):
    """Orders of the plain models, the chosen one last, before any other law of the plant is tried."""
    ny = train[0].y.shape[1]
    outputs = range(ny)
    models, _ = linear.plain_models(
        Records.of(train, outputs), Records.of(valid, outputs), channels(kind, ny), outputs, 10
    )
    return [model.plant.order for model in models]


def order_chosen(blocks_of, trained=None):
    """The order that is chosen for a kind `other` when the models of order n have the held-out blocks blocks_of[n].

    Those of higher orders are as those of the last. `trained` is the size of the training errors of an order, else 1.
    """
    nothing = records(np.zeros((1, 40)), np.zeros((1, 40, 1)), 1.0)

    white = np.random.default_rng(0).standard_normal((1, 40, 1))

    def fitted(plant, *_):
        errors = (trained or {}).get(plant.order, 1.0) * white
        return Estimate(plant, np.zeros(plant.size), np.zeros((1, 1)), errors, 1.0, True)

    def errors(fit, *_):
        return np.asarray(blocks_of[min(fit.plant.order, max(blocks_of))], dtype=float)

    with patch.object(linear, "fit_plain", fitted), patch.object(linear, "block_errors", errors):
        return linear.plain_models(nothing, nothing, channels("other", 1), (0,), 10)[0][-1].plant.order


def runs_on(search):
    """Whether the plain model says that the input is not held between samples."""
    return len(search.plant.taps) > 1


def excerpts(made, samples):
    """The pieces that a search looks at."""
    return _samples.excerpts(made, samples)


def plant_with_interval(search, made):
    """Theta of the plain model fitted to all of these experiments, with the ends of its 95 % intervals."""
    fit = FittedPlant.fit(search.estimate, search, made)
    return (fit.estimate.theta, *intervals(fit))


def share_left_over(search):
    """Share of the plain model's squared error that other forces of the input and the motion predict."""
    return _leftover.look_for_more(search.estimate, search.train).share


def selected(train, valid, kind):
    """The model with the effects that are chosen for these records."""
    return select(plain_search(train, valid, kind)).trial
