"""Whether the input is held between samples or runs on, told from the data."""

import numpy as np
import pytest

from .building import plain_errors, plain_search, runs_on
from .parts import experiments
from .plants import free_run, position, steps, velocity

DT = 0.1


def sines(rng, shape):
    """Smooth inputs [E, T]: five sines with periods of 8 to 60 samples."""
    k, periods = np.arange(shape[1])[:, None], np.geomspace(8, 60, 5)
    return np.stack([np.sin(2 * np.pi * (k / periods + rng.random(5))).sum(axis=1) / 3 for _ in range(shape[0])])


def search_on(plant, kind, smooth, u, seed=0):
    y, _ = free_run(plant, u, DT, smooth=smooth)
    y = y + 0.01 * y.std() * np.random.default_rng(seed).standard_normal(y.shape)
    made = experiments(u, y, DT)
    return plain_search(made[:3], made[3:], kind)


@pytest.mark.parametrize(("plant", "kind"), [(velocity(), "velocity"), (position(), "position")])
def test_an_input_that_runs_on_between_samples_is_told_from_one_that_is_held(plant, kind):
    u = sines(np.random.default_rng(0), (4, 200))
    assert runs_on(search_on(plant, kind, True, u))
    assert not runs_on(search_on(plant, kind, False, u))


def test_steps_that_are_held_are_held():
    assert not runs_on(search_on(velocity(), "velocity", False, steps(np.random.default_rng(1), (4, 200))))


def test_an_input_that_comes_late_is_not_taken_for_one_that_runs_on():
    u = sines(np.random.default_rng(2), (4, 200))
    y, _ = free_run(velocity(), np.concatenate((u[:, :1], u[:, :-1]), axis=1), DT)
    made = experiments(u, y + 0.01 * y.std() * np.random.default_rng(3).standard_normal(y.shape), DT)
    assert not runs_on(plain_search(made[:3], made[3:], "velocity"))


def test_with_an_input_that_runs_on_the_errors_are_the_noise():
    search = search_on(velocity(), "velocity", True, sines(np.random.default_rng(4), (4, 200)))
    spread = search.train.y.std()
    assert plain_errors(search).std() == pytest.approx(0.01 * spread, rel=0.1)
