"""How far a record sets two models apart: beside what statistics and a fit say of the same."""

import math
from dataclasses import replace

import numpy as np
import pytest

from simgap.data.simulated.rigs import hide
from simgap.experiment_design.answer import narrowed
from simgap.experiment_design.rivals import Question, rival_of
from simgap.experiment_design.search import decides
from simgap.experiment_design.separation import refitted, separations, simulate
from simgap.experiment_design.signals import Shape
from simgap.greybox.additions import add
from simgap.greybox.linear import find_baseline
from simgap.greybox.noise import white_as_large_as
from simgap.greybox.terms import Term
from simgap.registry import EFFECTS


@pytest.fixture(scope="module")
def question():
    """A delay against a lag, both fitted to two records of a cart with a delay."""
    data = hide("cart", {"input_delay": 0.4}, noise=0.1, seed=1)
    train = data.training.train[:2]
    baseline = find_baseline(train, data.training.valid[:1], data.channels, (0,), data.n_init)
    names = ("input_delay", "actuator_lag")
    fits = [add(baseline, baseline.estimate, Term(EFFECTS[name]())) for name in names]
    noise = white_as_large_as(fits[0].errors, baseline.train.mask, baseline.resolution)
    rivals = tuple(rival_of(name, fit, baseline, noise, 0.0) for name, fit in zip(names, fits, strict=True))
    return Question(rivals, ((0, 1),), noise, baseline.train, (0,))


def inputs(*shapes):
    return np.stack([shape.between(-4.0, 4.0, 150) for shape in shapes])[:, :, None]


FAST, SLOW = Shape("switching", 1.0, 0.0, 12.0, 3), Shape("sines", 0.3, 0.0, 60.0, 3)


def test_a_model_is_not_set_apart_from_itself(question):
    same = replace(question, rivals=(question.rivals[0], question.rivals[0]))
    assert separations(same, inputs(FAST, SLOW)) == pytest.approx(0.0, abs=1e-6)


def test_a_record_that_shows_the_difference_separates_more_than_one_that_does_not(question):
    fast, slow = separations(question, inputs(FAST, SLOW))[0].min(axis=0)
    assert fast > 10 * slow


def test_a_fit_of_the_wrong_model_leaves_what_the_linearised_one_promises(question):
    u = inputs(FAST)
    promised = separations(question, u)[0, :, 0]
    for at, (true, other) in enumerate(((0, 1), (1, 0))):
        d, difference = refitted(question, true, other, u[0])
        assert d == pytest.approx(promised[at], rel=0.25)
        assert np.sum((difference / question.noise.deviations) ** 2) <= d * (1 + 1e-6)


def test_what_another_gain_would_make_good_counts_for_nothing_where_nothing_is_known_of_the_gain(question):
    delayed = question.rivals[0]
    theta = delayed.estimate.theta.copy()
    theta[delayed.forecast.plant.layout.gains] *= 1.01
    louder = replace(delayed, estimate=replace(delayed.estimate, theta=theta))
    pair, u = replace(question, rivals=(louder, delayed)), inputs(FAST)
    apart = simulate(louder, u) - simulate(delayed, u)
    free = replace(pair, rivals=(louder, replace(delayed, information=0 * delayed.information)))
    held = replace(pair, rivals=(louder, replace(delayed, held=np.ones(len(theta), dtype=bool))))
    squares = np.sum(question.noise.whiten(apart) ** 2)
    assert separations(free, u)[0, 0, 0] < 1e-3 * squares
    assert separations(free, u)[0, 0, 0] < separations(pair, u)[0, 0, 0] < separations(held, u)[0, 0, 0] <= squares


def test_the_chance_of_a_decision_is_that_of_drawn_errors():
    rng = np.random.default_rng(0)
    for d, behind in ((9.0, 0.0), (30.0, 2.0), (30.0, -4.0)):
        # Of two simple models that differ by delta: 2 log(L_true / L_other) = |delta|^2 + 2 delta' e.
        delta = np.full(20, math.sqrt(d / 20))
        ratio = 0.5 * d + rng.standard_normal((20000, 20)) @ delta - behind
        assert decides(d, behind) == pytest.approx(np.mean(ratio > 6.0), abs=0.015)
    assert decides(0.0, 0.0) == 0.0


def test_an_interval_whose_ends_are_set_apart_by_as_much_as_before_is_the_root_of_two_narrower():
    d = (2 * 1.96) ** 2  # of ends that lie 2 * 1.96 standard deviations apart
    assert narrowed(d) == pytest.approx(1 / math.sqrt(2))
