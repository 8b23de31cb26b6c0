"""Every object of the package that the tests of this folder need is made here, and every call of it goes through here.

Arrays go in and come out; what is opaque (a search, a term, a trial) is only handed on to another function of this
file. So a change of names or places in the package changes this file alone.
"""

from dataclasses import replace
from typing import NamedTuple
from unittest.mock import patch

import numpy as np

from simgap.baselines.grey import leftover as _leftover
from simgap.baselines.grey import linear, noise, outliers, scenes, starting
from simgap.baselines.grey.least_squares import Estimate, Problem, Records, Slopes, _Normal
from simgap.baselines.grey.machine import Machine
from simgap.baselines.grey.search import Search
from simgap.baselines.grey.structure import Scenes, Structure, Term
from simgap.baselines.grey.trial import Trial
from simgap.effects.effect import Scene
from simgap.records import Channel, Channels, Experiment
from simgap.registry import EFFECTS

SCENE = Scene("position", 2, 0.01, 1.0, -10.0, 10.0, 5.0, -90.0, 90.0, 40.0, 90.0, 200.0, 100.0, 1000.0)

# ------------------------------------------------------------------ records


def experiments(u, y, dt, lengths=None):
    """Experiments of inputs u [E, T] and outputs y [E, T, ny], each cut to its length."""
    lengths = lengths or [u.shape[1]] * len(u)
    return [Experiment(f"e{i}", u[i, :n, None], y[i, :n], dt) for i, n in enumerate(lengths)]


def channels(kind, ny=1):
    """One input and one output of that kind, or a position with its velocity."""
    outputs = (Channel("x", "m", "position"), Channel("v", "m/s", "velocity")) if ny == 2 else (Channel("y", "", kind),)
    return Channels((Channel("u", "V"),), outputs)


def records(u, y, dt, measured=None):
    """Records side by side: u [E, T], y [E, T, ny], measured [E, T]."""
    seen = np.ones(u.shape, dtype=bool) if measured is None else measured
    return Records(np.ascontiguousarray(u[:, :, None]), y, seen, dt)


# ------------------------------------------------------------------ search


def plain_search(train, valid, kind, ny=1):
    """A search with its plain model, before any effect was tried."""
    search = Search.of(train, valid, channels(kind, ny), tuple(range(ny)))
    search.threads = 1
    return search


def term(name):
    """An effect of the catalogue on the first channel."""
    return Term(EFFECTS[name]())


def candidates(search, *present):
    """Names of the effects that could be added to a model with these."""
    return [t.effect.name for t in search.candidates([term(name) for name in present])]


def cut_in_pieces(search):
    """The same search on records that are only pieces of experiments."""
    return replace(search, cut=True)


def scores_of(search, name):
    """The score test of every start of an effect: gain of log-likelihood, and the values that it moves to."""
    here = search.plain
    slopes = Problem(here.structure, search.train, search.base_noise).slopes(
        here.theta, here.local, here.structure.free
    )
    added = term(name)
    scored = search.screen(here, search.structure.having([added]), added, slopes)
    return [(gain, start.values) for gain, start in scored]


def score_of(search, name):
    """The best of them."""
    return max(scores_of(search, name))


def plain_errors(search):
    """Training errors of the plain model, of all measured samples: [N, ny]."""
    return search.plain.errors[search.train.mask]


def gain_of_refit(search, name):
    """Half of N times the fall of the log of the squared errors, when the package fits the effect along."""
    found = search.add(search.plain, term(name))
    after = found.errors[search.train.mask]
    return 0.5 * after.size * np.log(search.plain_squares / found.squares)


def with_effects(search, *names):
    """The assessed model with these effects, fitted one after the other."""
    found = search.plain
    for name in names:
        found = search.add(found, term(name))
    return search.assess(found)


def best_of_round(search):
    """The plain model and the best of all its extensions by one effect."""
    return search.assess(search.plain), search.round(search.plain)[0]


def names_of(trial):
    """The effects of a trial."""
    return trial.names


def sizes_of(trial):
    """Effect -> its fitted parameters, of a trial."""
    structure = trial.estimate.structure
    return {t.effect.name: trial.estimate.theta[structure.term_at(t)] for t in trial.terms}


def pruned(search, trial):
    """What is left of a trial's effects without the superfluous ones."""
    return search.prune(trial).names


def most_missed(search, trial):
    """The effects of a trial in the order of what is lost without them."""
    return [t.effect.name for t, _ in search.losses(trial)]


# ------------------------------------------------------------------ trials


def trial(search, squares=1.0, log_likelihood=0.0, parameters=1, own=0, held_out=None, held_out_gain=0.0, own_there=0):
    """A trial of hand-made numbers.

    `squares` of the plain model's; `own` and `own_there` count numbers of single experiments in training and held-out
    data; `held_out` are the squares of held-out blocks, `held_out_gain` the log-likelihood of held-out data.
    """
    estimate = replace(search.plain, squares=squares * search.plain_squares)
    blocks = np.ones(20) if held_out is None else np.asarray(held_out, dtype=float)
    return Trial((), estimate, float(log_likelihood), float(held_out_gain), parameters, own, own_there, blocks)


def score_of_trial(made):
    """Log-likelihood less what the parameters cost."""
    return made.score


def significant(search, smaller, larger):
    """Whether the larger trial is to be believed."""
    return search.significant(smaller, larger)


def ranked(search, trials):
    """The trials, best first."""
    return search._rank(trials)


def chances(search):
    """How many starts of effects noise could pass for one with."""
    return 2 * len(search.candidates(()))


def samples_held_out(search):
    """Samples of the longest held-out record."""
    return search.valid.mask.shape[1]


# ------------------------------------------------------------------ plain models


def order_of(search):
    """The order of the plain plant."""
    return search.plain.structure.order


def orders_tried(train, valid, kind):
    """Orders of the plain models, the chosen one last, before any other law of the plant is tried."""
    ny = train[0].y.shape[1]
    models = linear.plain_models(Records.of(train, range(ny)), Records.of(valid, range(ny)), kind)
    return [model.structure.order for model in models]


def order_chosen(blocks_of):
    """The order that is chosen for a kind `other` when the models of order n have the held-out blocks blocks_of[n]."""
    nothing = records(np.zeros((1, 40)), np.zeros((1, 40, 1)), 1.0)

    def fitted(structure, *_):
        return Estimate(structure, np.zeros(structure.size), np.zeros((1, 1)), np.zeros((1, 40, 1)), 1.0, True)

    def errors(fit, _):
        return np.asarray(blocks_of[fit.structure.order], dtype=float)

    with patch.object(linear, "fit_plain", fitted), patch.object(linear, "block_errors", errors):
        return linear.plain_models(nothing, nothing, "other")[-1].structure.order


def runs_on(search):
    """Whether the plain model says that the input is not held between samples."""
    return len(search.plain.structure.taps) > 1


def excerpts(made, samples):
    """The pieces that a search looks at."""
    return linear.excerpts(made, samples)


# ------------------------------------------------------------------ noise


def noise_of(polynomials, deviations):
    """Autoregressive noise D(q) e = w for each output, D monic [ny, m], w of these deviations."""
    return noise.Noise(np.array(polynomials, dtype=float), np.array(deviations, dtype=float))


def white_noise(*deviations):
    """Noise without memory."""
    return noise.white(np.array(deviations))


def whitened(made, e):
    """Errors e [E, T, ny] in units of the white noise behind them."""
    return made.whiten(e)


def estimated_noise(e, measured, order):
    """Polynomials [ny, order + 1] and deviations [ny]."""
    found = noise.estimate(e, measured, order)
    return found.polynomials, found.deviations


def log_likelihood(e, measured, order):
    """Of errors e [E, T, ny], up to a constant."""
    return noise.log_likelihood(e, measured, order)


def chosen_noise_order(e):
    """The memory of errors e [E, T, 1] that the search settles on."""
    data = records(e[:, :, 0], e, 0.1)
    structure = Structure("velocity", 1, 1, 0.1)
    fit = Estimate(structure, np.zeros(2), np.zeros((len(e), 1)), e, 1.0, True)
    search = Search(data, data, channels("velocity"), (0,), structure, fit)
    search._choose_noise_order(fit)
    return search.noise_order


# ------------------------------------------------------------------ fitting


class Model(NamedTuple):
    """A model structure and its parameters."""

    structure: Structure
    theta: np.ndarray

    def part(self, number):
        """Where shape, gains, offset, zeros and the velocity's scale stand in theta, in this order."""
        return self.structure.at[number]


def model(kind, dt, shape, gain, effects=(), two_outputs=False, offset=None, zeros=()):
    """A plant with effects, each at its first start."""
    both = Scenes((SCENE,), (SCENE, SCENE))
    structure = Structure(
        kind, len(shape), 1, dt, zeros=len(zeros), two_outputs=two_outputs, offset=offset is not None, scenes=both
    ).having([term(name) for name in effects])
    theta = np.zeros(structure.size)
    values = (shape, [gain], [] if offset is None else [offset], zeros, [1.0] * two_outputs)
    for at, value in zip(structure.at, values, strict=False):
        theta[at] = value
    for t in structure.terms:
        if t not in structure.local:
            theta[structure.term_at(t)] = structure.starts_of(t)[0].values
    return Model(structure, theta)


def own_numbers(made):
    """How many numbers every record has for itself: its start, then its sensors' errors."""
    return made.structure.n_local


def outputs_of(made):
    """How many outputs it has."""
    return made.structure.ny


def signless(made):
    """Whether readings do not tell on which side of zero they are."""
    return made.structure.signless


def simulated(made, data, own, theta=None):
    """Outputs [E, T, ny] from the own numbers [E, q] of each record."""
    problem = Problem(made.structure, data, noise.white(np.ones(made.structure.ny)))
    return problem.simulator.run(made.theta if theta is None else theta, own)


def jacobian(made, data, own, weighing):
    """d(whitened simulation) / d(theta) [p, E, M] and / d(own numbers) [q, E, M]."""
    slopes = Problem(made.structure, data, weighing).slopes(made.theta, own, np.ones(len(made.theta), dtype=bool))
    return slopes.theta, slopes.local


def step(of_theta, of_own, errors, inside, damping):
    """The step of theta [p] and of the own numbers [E, q], and the fall of the squares that it promises."""
    return _Normal.of(Slopes(of_theta, of_own), errors).step(inside, damping)


def fitted(made, data, weighing, fixed=None):
    """Theta and own numbers of a fit that begins at the model's theta."""
    found = Problem(made.structure, data, weighing).fit(made.theta, fixed=fixed)
    return found.theta, found.local


def own_numbers_of_each(made, data, weighing):
    """The own numbers of each record, found by a fit of that record alone in which theta is fixed."""
    alone = [Records(data.u[i : i + 1], data.y[i : i + 1], data.mask[i : i + 1], data.dt) for i in range(len(data.u))]
    fixed = np.ones(len(made.theta), dtype=bool)
    return np.concatenate(
        [Problem(made.structure, one, weighing).fit(made.theta, fixed=fixed, max_steps=15).local for one in alone]
    )


def initial_states(made, data, weighing):
    """The states [E, q] at the first sample of each record."""
    return starting.starts(made.structure, made.theta, data.u, data.y, weighing)


def plant_with_interval(search, made):
    """Theta of the plain model fitted to all of these experiments, with the ends of its 95 % intervals."""
    fit = Machine.fit(search.plain, search, made)
    return (fit.estimate.theta, *fit.intervals())


# ------------------------------------------------------------------ what is seen before and after a search


def outliers_flagged(e, measured):
    """Which readings [E, T, ny] stand out of their neighbourhood."""
    return outliers.flag(e, measured)


def outliers_found(e, measured):
    """For each output with outliers: its number, rate, size, share of the squared error, log-likelihood ratio."""
    return [(f.output, f.rate, f.size, f.share, f.log_likelihood_ratio) for f in outliers.find(e, measured)]


def measured_without_outliers(e, measured):
    """The mask [E, T] once the outliers of errors e are left out."""
    data = records(e[:, :, 0], e, 1.0, measured)
    return outliers.left_out(data, e, outliers.find(e, measured)).mask


def lines(e, dt):
    """Frequencies in Hz that the errors [E, T] of all experiments share."""
    return scenes.lines(e, dt)


def lattice(y):
    """Step of the grid on which all readings [E, T] lie, 0 without one."""
    return scenes.lattice(y)


def share_left_over(search):
    """Share of the plain model's squared error that other forces of the input and the motion predict."""
    return _leftover.look_for_more(search.plain, search.train).share
