"""Effects in and out of a model: what the others make superfluous goes, what is missed most is named first."""

import numpy as np
import pytest

from .building import in_order, plain_search, pruned, sizes_of, with_effects
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


def test_the_effect_that_takes_most_of_the_held_out_error_comes_first(search):
    found = with_effects(search, "dead_zone", "constant_load")
    assert in_order(search, found) == ["constant_load", "dead_zone"]


def test_the_fitted_effects_have_their_true_sizes(search):
    found = sizes_of(with_effects(search, "constant_load", "dead_zone"))
    assert found["constant_load"] == pytest.approx(0.3, rel=0.05)
    assert found["dead_zone"] == pytest.approx(0.1, rel=0.1)
