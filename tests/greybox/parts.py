"""Plants, records, noise and fits, without a selection of effects: the lower half of building.py."""

from typing import NamedTuple

import numpy as np

from simgap.greybox import initial_states as starts
from simgap.greybox import noise, outliers, samples, signal_scales, subspace_start
from simgap.greybox.effects.scales import SignalScales
from simgap.greybox.fitting import descend
from simgap.greybox.normal_equations import Jacobian, NormalEquations
from simgap.greybox.past import Past
from simgap.greybox.plant import Plant
from simgap.greybox.problem import Problem
from simgap.greybox.samples import Records
from simgap.greybox.terms import PlantScales, Term
from simgap.records import Channel, Channels, Experiment
from simgap.registry import EFFECTS

SCALES = SignalScales("position", 2, 0.01, 1.0, -10.0, 10.0, 5.0, -90.0, 90.0, 40.0, 90.0, 200.0, 100.0, 1000.0)

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
    return Records(np.ascontiguousarray(u[:, :, None]), y, seen, dt, Past.none(u[:, :, None]))


def term(name):
    """An effect of the catalogue on the first channel."""
    return Term(EFFECTS[name]())


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
    return noise.schwarz_order(e, np.ones(e.shape[:2], dtype=bool))


# ------------------------------------------------------------------ fitting


class Model(NamedTuple):
    """A plant and its parameters."""

    plant: Plant
    theta: np.ndarray

    def part(self, number):
        """Where poles, gains, offset, zeros and the velocity's scale stand in theta, in this order."""
        layout = self.plant.layout
        return (layout.poles, layout.gains, layout.offset, layout.zeros, layout.velocity)[number]


def model(kind, dt, shape, gain, effects=(), two_outputs=False, offset=None, zeros=(), fastest=np.inf):
    """A plant with effects, each at its first start; its plain model had a pole of rate `fastest`."""
    both = PlantScales((SCALES,), (SCALES, SCALES), fastest)
    plant = Plant(
        kind, len(shape), 1, dt, zeros=len(zeros), two_outputs=two_outputs, offset=offset is not None, scales=both
    ).having([term(name) for name in effects])
    made = Model(plant, np.zeros(plant.size))
    values = (shape, [gain], [] if offset is None else [offset], zeros, [1.0] * two_outputs)
    for number, value in enumerate(values):
        made.theta[made.part(number)] = value
    for t in plant.terms:
        if t not in plant.per_experiment:
            made.theta[plant.part_of(t)] = plant.starts_of(t)[0].values
    return made


def own_numbers(made):
    """How many numbers every record has for itself: its start, then its sensors' errors."""
    return made.plant.n_local


def outputs_of(made):
    """How many outputs it has."""
    return made.plant.ny


def signless(made):
    """Whether readings do not tell on which side of zero they are."""
    return made.plant.sign_hidden


def simulated(made, data, own, theta=None):
    """Outputs [E, T, ny] from the own numbers [E, q] of each record."""
    problem = Problem(made.plant, data, noise.white(np.ones(made.plant.ny)))
    return problem.simulator.run(made.theta if theta is None else theta, own)


def jacobian(made, data, own, weighing):
    """d(whitened simulation) / d(theta) [p, E, M] and / d(own numbers) [q, E, M]."""
    of = Problem(made.plant, data, weighing).jacobian(made.theta, own, np.ones(len(made.theta), dtype=bool))
    return of.theta, of.local


def step(of_theta, of_own, errors, inside, damping):
    """The step of theta [p] and of the own numbers [E, q], and the fall of the squares that it promises."""
    return NormalEquations.of(Jacobian.of(of_theta, of_own), errors).step(inside, damping)


def fitted(made, data, weighing, fixed=None):
    """Theta and own numbers of a fit that begins at the model's theta."""
    found = descend(Problem(made.plant, data, weighing), made.theta, fixed=fixed)
    return found.theta, found.local


def own_numbers_of_each(made, data, weighing):
    """The own numbers of each record, found by a fit of that record alone in which theta is fixed."""
    alone = [data.only(np.array([i])) for i in range(len(data.u))]
    fixed = np.ones(len(made.theta), dtype=bool)
    return np.concatenate(
        [descend(Problem(made.plant, one, weighing), made.theta, fixed=fixed, max_steps=15).local for one in alone]
    )


def initial_states(made, data, weighing):
    """The states [E, q] at the first sample of each record."""
    return starts.initial_states(problem_of(made, data, weighing), made.theta)


def started_from_projections(data, order):
    """Plants of an order with all zeros, and where their fits begin."""
    plant = Plant("other", order, 1, data.dt, zeros=order - 1, offset=True)
    return [Model(plant, theta) for theta in subspace_start.starts(plant, subspace_start.linear_models(data, [order]))]


def problem_of(made, data, weighing):
    """The plant with records."""
    return Problem(made.plant, data, weighing)


def usual_start(made, data, weighing, n_init):
    """Where the records start beside their first samples, as a fit of their initial states tells it."""
    estimate = descend(Problem(made.plant, data, weighing), made.theta, fixed=np.ones(len(made.theta), dtype=bool))
    return starts.usual_start(estimate, data, weighing, n_init)


# ------------------------------------------------------------------ what is seen before and after a search


def outliers_flagged(e, measured):
    """Which readings [E, T, ny] stand out of their neighbourhood."""
    return outliers.flag(e, measured)


def outliers_found(e, measured):
    """For each output with outliers: its number, rate, size, share of the squared error, log-likelihood ratio."""
    return [(f.output, f.rate, f.size, f.share, f.log_likelihood_ratio) for f in outliers.find_outliers(e, measured)]


def measured_without_outliers(e, measured):
    """The mask [E, T] once the outliers of errors e are left out."""
    data = records(e[:, :, 0], e, 1.0, measured)
    return outliers.without_outliers(data, e, outliers.find_outliers(e, measured)).mask


def tones(e, dt):
    """Frequencies that stand out in the errors, whatever their phase."""
    return signal_scales.tones(e, dt)


def lines(e, dt, since=0.0):
    """Frequencies in Hz that the errors [E, T] of all experiments share, which began `since` seconds after the run."""
    return signal_scales.lines(e, dt, np.broadcast_to(since, len(e)))


def lattice(y):
    """Step of the grid on which all readings [E, T] lie, 0 without one."""
    return samples.quantisation_step(y)
