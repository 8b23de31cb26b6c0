"""Effects in and out of a model: what the others make superfluous goes, what is missed most is named first."""

import numpy as np
import pytest

from simgap.data.simulated.rigs import hide

from .building import (
    added_to,
    added_where_free_runs_need,
    in_order,
    passing_alone,
    plain_search,
    pruned,
    sizes_of,
    with_effects,
    without_each,
)
from .parts import experiments
from .plants import free_run, steps, velocity


@pytest.fixture(scope="module")
def search():
    """A load of 0.3 and a dead zone of 0.1: errors of the model without the one or the other differ by far."""
    rng = np.random.default_rng(2)
    u = steps(rng, (4, 120), low=-0.8)
    arrived = np.sign(u) * np.maximum(np.abs(u) - 0.1, 0.0)
    y = free_run(velocity(), arrived + 0.15, 0.1)[0] + 0.02 * rng.standard_normal((4, 120, 1))
    made = experiments(u, y, 0.1)
    return plain_search(made[:3], made[3:], "velocity")


def test_an_effect_that_is_not_there_is_taken_out_again(search):
    found = with_effects(search, "constant_load", "dead_zone", "quadratic_drag")
    assert set(pruned(search, found)) == {"constant_load", "dead_zone"}


def test_effects_that_are_there_stay(search):
    assert set(pruned(search, with_effects(search, "constant_load", "dead_zone"))) == {"constant_load", "dead_zone"}


@pytest.mark.parametrize(("together", "added"), [(2, {"constant_load", "dead_zone"}), (3, set())])
def test_two_effects_are_added_at_once_where_free_runs_get_no_better_with_one_of_them(search, together, added):
    assert set(added_where_free_runs_need(search, together)) == added


def test_what_pruning_has_fitted_is_what_a_fit_without_each_effect_gives(search):
    (kept, anew), fitted = without_each(search, with_effects(search, "constant_load", "dead_zone", "quadratic_drag"))
    assert kept == anew
    assert fitted == len(anew) == 2


def test_the_effect_that_takes_most_of_the_held_out_error_comes_first(search):
    found = with_effects(search, "dead_zone", "constant_load")
    assert in_order(search, found) == ["constant_load", "dead_zone"]


def test_the_fitted_effects_have_their_true_sizes(search):
    found = sizes_of(with_effects(search, "constant_load", "dead_zone"))
    assert found["constant_load"] == pytest.approx(0.3, rel=0.05)
    assert found["dead_zone"] == pytest.approx(0.1, rel=0.1)


@pytest.mark.parametrize("name", ["quadratic_drag", "sensor_lag"])
def test_an_effect_that_stands_alone_must_pass_against_the_plain_model(name):
    rng = np.random.default_rng(4)
    u = steps(rng, (4, 120))
    y = free_run(velocity(), u, 0.1)[0] + 0.02 * rng.standard_normal((4, 120, 1))
    made = experiments(u, y, 0.1)
    linear = plain_search(made[:3], made[3:], "velocity")
    assert pruned(linear, with_effects(linear, name)) == ()


@pytest.mark.parametrize(("hidden", "named"), [("coulomb_friction", "coulomb_friction"), ("load_friction",) * 2])
def test_what_makes_an_effect_more_general_must_pass_too(hidden, named):
    data = hide("cart", {hidden: 1.0}, noise=0.05, seed=7).training
    plain = plain_search(data.train, data.valid, "velocity")
    assert pruned(plain, with_effects(plain, "load_friction")) == (named,)


def test_what_the_readings_seemed_to_show_must_pass_against_the_rest_too():
    # Readings that never fall below zero look like those of a sensor without sign; the machine just does not go there.
    rng = np.random.default_rng(5)
    u = steps(rng, (4, 120), low=0.2)
    y = np.abs(free_run(velocity(), u, 0.1)[0] + 0.02 * rng.standard_normal((4, 120, 1)))
    made = experiments(u, y, 0.1)
    one_sided = plain_search(made[:3], made[3:], "velocity")
    assert pruned(one_sided, with_effects(one_sided, "absolute_sensor")) == ()


@pytest.mark.parametrize(
    ("rig", "effects"),
    [
        ("cart", {"coulomb_friction": 1.0, "dead_zone": 1.0}),
        pytest.param("stage", {"absolute_sensor": 1.0, "cubic_stiffness": 1.0}, marks=pytest.mark.slow),
        pytest.param("slide", {"quadratic_drag": 1.0, "sensor_drift": 1.0}, marks=pytest.mark.slow),
    ],
)
def test_every_effect_of_the_answer_passes_alone_against_the_rest(rig, effects):
    assert passing_alone(hide(rig, effects, noise=0.05, seed=3).training) >= set(effects)


@pytest.mark.slow
def test_a_special_case_of_the_best_effect_is_fitted_from_its_plant_too():
    # A valve that sticks and does not jump is play; seen from the poles of the plain model, play fits worse.
    assert passing_alone(hide("tanks", {"backlash": 1.0}, noise=0.05, seed=304).training) == {"backlash"}


@pytest.mark.parametrize("late", [False, True])
def test_unequal_gains_are_found_before_a_dead_zone_and_behind_it(late):
    rng = np.random.default_rng(5)
    u = steps(rng, (4, 150))

    def unequal(w):
        return w * np.where(w > 0, 1.3, 0.7)

    def narrowed(w):
        return np.sign(w) * np.maximum(np.abs(w) - 0.2, 0.0)

    arrived = unequal(narrowed(u)) if late else narrowed(unequal(u))
    y = free_run(velocity(), arrived, 0.1)[0] + 0.01 * rng.standard_normal((4, 150, 1))
    made = experiments(u, y, 0.1)
    found = sizes_of(with_effects(plain_search(made[:3], made[3:], "velocity"), "asymmetric_gain", "dead_zone"))
    assert found["asymmetric_gain"] == pytest.approx(0.3, rel=0.03)
    assert found["dead_zone"] == pytest.approx(0.2, rel=0.03)


def test_effects_are_added_anew_where_a_better_fit_of_the_same_model_is_at_hand(search):
    remembered = {}
    first = added_to(search, 1.1, remembered)
    assert all(a is b for a, b in zip(first, added_to(search, 1.09, remembered), strict=True))
    assert not any(fit in first for fit in added_to(search, 1.0, remembered))
