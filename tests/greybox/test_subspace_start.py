"""A linear model in samples, written as a plant in continuous time."""

import numpy as np
import pytest

from .parts import records, simulated, started_from_projections
from .plants import Plant, free_run, steps

RATES = {"swinging": [-0.3 + 4j, -0.3 - 4j, -1.0 + 9j, -1.0 - 9j], "real": [-0.5, -2.0, -6.0]}


def plant_of(rates, seed=0):
    """A plant with these poles and zeros that follow from random residues."""
    rng = np.random.default_rng(seed)
    n = len(rates)
    a = np.diag(np.ones(n - 1), 1)
    a[-1] = -np.real(np.poly(rates))[:0:-1]
    b = np.zeros((n, 1))
    b[-1] = 1.0
    weights = np.abs(np.prod(rates)) / np.abs(rates[0]) ** np.arange(n)
    return Plant(a, b, rng.uniform(0.5, 1.0, (1, n)) * weights)


@pytest.mark.parametrize("rates", RATES.values(), ids=RATES)
def test_a_model_without_noise_starts_the_fit_at_the_plant(rates):
    rng = np.random.default_rng(1)
    u = steps(rng, (3, 400), hold=2)
    y, _ = free_run(plant_of(rates), u, 0.05)
    data = records(u, y, 0.05)
    for made in started_from_projections(data, len(rates)):
        at_rest = np.zeros((3, len(rates)))
        np.testing.assert_allclose(simulated(made, data, at_rest), y, atol=1e-5 * y.std())


def test_records_too_short_for_any_model_give_no_start():
    rng = np.random.default_rng(1)
    u = steps(rng, (2, 12))
    assert not started_from_projections(records(u, rng.normal(size=(2, 12, 1)), 0.05), 3)


def test_a_gap_is_bridged_by_a_straight_line():
    rng = np.random.default_rng(2)
    u = steps(rng, (3, 400), hold=2)
    y, _ = free_run(plant_of(RATES["real"]), u, 0.05)
    measured = np.ones(u.shape, dtype=bool)
    measured[0, [50, 200]] = measured[1, 300:] = False
    spoiled = np.where(measured[:, :, None], y, 1e3)
    for made in started_from_projections(records(u, spoiled, 0.05, measured), 3):
        error = simulated(made, records(u, y, 0.05), np.zeros((3, 3))) - y
        assert error.std() < 0.05 * y.std()
