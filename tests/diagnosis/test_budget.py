"""Where the plain model's error goes: shares that add up, noise that is not learnable, a floor from repeated runs."""

import math
from dataclasses import replace

import numpy as np
import pytest
from grey_boxes import plain_grey_box

from simgap.data.simulated.rigs import hide
from simgap.diagnosis import gains
from simgap.diagnosis.budget import budgets
from simgap.diagnosis.diagnose import diagnose
from simgap.diagnosis.odd_runs import odd_runs
from simgap.diagnosis.repeats import repeated, variance_of_repeats
from simgap.greybox.model import GreyBoxModel
from simgap.known_plant import KnownPlant
from simgap.records import Channel, Channels, Dataset, Experiment, TrainingSet


def total(budget):
    return sum(budget.causes.values()) + budget.learnable + (budget.floor or 0.0) + budget.unexplained


def without_names(dataset):
    """The budget of the plain model alone, as if nothing had been found."""
    plain = plain_grey_box(dataset.training)
    before = [gains.free_run(plain, x, dataset.n_init) for x in dataset.test]
    return budgets(None, plain, dataset, before, 0)


@pytest.fixture(scope="module")
def friction():
    return hide("cart", {"coulomb_friction": 1.0, "dead_zone": 1.0}, noise=0.05, seed=5)


@pytest.fixture(scope="module")
def named(friction):
    return diagnose(friction).findings


def test_the_shares_add_up_to_the_whole_error(named):
    assert [total(budget) for budget in named.budget] == pytest.approx([1.0])


def test_each_cause_takes_its_share_in_the_order_in_which_they_are_listed(named):
    (budget,) = named.budget
    assert list(budget.causes) == [cause.effect for cause in named.causes]
    taken = 1 - (named.gain.after["v"] / named.gain.before["v"]) ** 2
    assert sum(budget.causes.values()) == pytest.approx(taken)
    assert next(iter(budget.causes.values())) > 0.3


def test_what_has_its_name_is_no_longer_learnable(named):
    assert named.budget[0].learnable < 0.01


def test_what_is_not_named_is_learnable(friction):
    (budget,) = without_names(friction)
    assert budget.causes == {}
    assert budget.learnable > 0.5
    assert total(budget) == pytest.approx(1.0)


def test_an_effect_outside_the_catalogue_is_learnable():
    (budget,) = without_names(hide("stage", {"negative_damping": 1.0}, noise=0.05, seed=2))
    assert budget.learnable > 0.3


@pytest.mark.parametrize("colour", [0.0, 0.9])
@pytest.mark.parametrize("seed", range(3))
def test_noise_is_neither_a_cause_nor_learnable(seed, colour):
    (budget,) = without_names(hide("cart", {}, noise=0.05, colour=colour, seed=seed))
    assert (budget.causes, budget.learnable, budget.floor, budget.unexplained) == ({}, 0.0, None, 1.0)


def mse(model, dataset):
    n = dataset.n_init
    return np.mean([(x.y[n:] - gains.free_run(model, x, n)) ** 2 for x in dataset.test])


def noisy(x, sd, rng, name):
    return Experiment(name, x.u, x.y + sd * rng.standard_normal(x.y.shape), x.dt)


@pytest.fixture(scope="module")
def repeats():
    """A rig without noise of its own, its first test experiment run eight times; and the variance of the noise."""
    still, rng = hide("cart", {"quadratic_drag": 1.0}, noise=0.0, seed=7), np.random.default_rng(8)
    sd = 0.05 * np.std(still.test[0].y)
    training = still.training
    train, valid = (tuple(noisy(x, sd, rng, x.name) for x in part) for part in (training.train, training.valid))
    test = tuple(noisy(still.test[0], sd, rng, f"run {i}") for i in range(8))
    return replace(still, training=replace(training, train=train, valid=valid), test=test), sd**2


def test_the_floor_is_the_noise_that_repeated_runs_differ_by(repeats):
    dataset, variance = repeats
    (budget,) = without_names(dataset)
    # What a start from a few noisy samples adds is part of it.
    assert budget.floor * mse(plain_grey_box(dataset.training), dataset) == pytest.approx(variance, rel=0.1)
    assert total(budget) == pytest.approx(1.0)
    assert budget.unexplained >= 0


def test_without_repeated_test_experiments_those_in_training_tell_the_floor(repeats):
    dataset, variance = repeats
    training = replace(dataset.training, train=dataset.training.train + dataset.test[:7])
    (budget,) = without_names(moved := replace(dataset, training=training, test=dataset.test[7:]))
    assert budget.floor * mse(plain_grey_box(moved.training), moved) == pytest.approx(variance, rel=0.1)


def test_a_copy_is_no_repeated_run_nor_is_one_from_elsewhere_or_with_another_input(repeats):
    dataset, _ = repeats
    one, two = dataset.test[:2]
    elsewhere = Experiment("elsewhere", two.u, two.y + np.ptp(two.y), two.dt)
    other = Experiment("other", 1.05 * two.u, two.y, two.dt)
    assert repeated([one, one, elsewhere, other], 20) == []
    assert repeated([one, elsewhere, two, other], 20) == [[0, 2]]
    still = Experiment("still", 0 * one.u, one.y, one.dt)
    assert repeated([still, Experiment("small", 1e-3 * one.u / np.std(one.u), one.y + 1e-9, one.dt)], 20) == []


def test_the_variance_between_two_runs_is_not_biased():
    rng = np.random.default_rng(9)
    u, errors = rng.standard_normal((20_000, 1)), 3.0 * rng.standard_normal((2, 20_000, 1))
    runs = [Experiment(f"{i}", u, 100 * u + e, 0.1) for i, e in enumerate(errors)]
    assert variance_of_repeats(runs, list(errors), 5) == pytest.approx(9.0, rel=0.05)


def test_a_plain_model_that_diverges_has_no_budget(friction):
    plain = plain_grey_box(friction.training)
    before = [np.full((len(x) - 20, 1), np.inf) for x in friction.test]
    (budget,) = budgets(None, plain, friction, before, 0)
    assert math.isnan(budget.unexplained) and budget.floor is None


def test_the_json_has_the_budget_of_every_output(named):
    answer = named.to_json()["budget"]
    assert set(answer) == {"v"}
    assert set(answer["v"]) == {"causes", "learnable", "floor", "unexplained"}
    assert answer["v"]["floor"] is None


def test_a_run_in_which_a_known_machine_stuck_is_named():
    class Follows(GreyBoxModel):
        def simulate(self, u, y_init, past=None):
            return u[:, y_init.shape[1] :]

    rng = np.random.default_rng(0)
    u = rng.normal(size=(12, 50, 1))
    y = u + 0.01 * rng.normal(size=u.shape)
    y[7] = 0.0
    runs = [Experiment(f"run_{i}", u[i], y[i], 0.1) for i in range(12)]
    channels = Channels((Channel("r"),), (Channel("q", "rad", "position"),), KnownPlant("r"))
    dataset = Dataset("arm", TrainingSet(tuple(runs[:9]), (), 5, channels), tuple(runs[9:]), 5, channels)
    (said,) = odd_runs(Follows(), dataset)
    assert said.startswith("The run run_7 is explained by no model")
