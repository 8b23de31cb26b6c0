"""A curve by its gains at several places: its equation, and that it is found where two numbers say too little."""

import numpy as np
import pytest

from simgap.greybox.effects.curved_sensor import CurvedSensor
from simgap.greybox.effects.finely_curved_sensor import FinelyCurvedSensor

from .building import selected
from .parts import experiments
from .plants import free_run, steps, velocity

GAINS = [0.4, 0.3, 0.5, 1.0, 0.5, 0.9, 0.8]
T = np.zeros(200)


@pytest.mark.parametrize(("ends", "tilt"), [(0.0, 0.0), (0.6, 0.0), (-0.3, 0.8), (0.2, -1.0)])
def test_a_curve_of_two_numbers_is_one_of_its_curves(ends, tilt):
    y, few = np.linspace(-6.0, 9.0, 200), np.array([ends, tilt, 2.0, 4.0])
    fine = CurvedSensor().as_refined(few)
    if tilt == -1.0:
        fine[6] = 0.0  # a gain that a fit begins a little above
    assert FinelyCurvedSensor.term(y, fine, T) == pytest.approx(CurvedSensor.term(y, few, T))


def test_its_gain_is_linear_between_the_places_and_one_in_the_mean():
    p = np.array([*GAINS, 5.0, 3.0])
    y = np.linspace(2.0, 8.0, 6001)
    reading = FinelyCurvedSensor.term(y, p, T)
    gain = np.gradient(reading, y)
    expected = np.interp(y, np.linspace(2.0, 8.0, 7), GAINS)
    assert gain[1:-1] == pytest.approx((expected / np.trapezoid(expected, y) * 6.0)[1:-1], rel=1e-3)
    assert reading[-1] - reading[0] == pytest.approx(6.0)


def test_it_goes_on_straight_beyond_its_range():
    p = np.array([*GAINS, 5.0, 3.0])
    below, above = (FinelyCurvedSensor.term(np.array(y), p, T) for y in ([0.0, 1.0, 2.0], [8.0, 9.0, 11.0]))
    assert np.diff(below, 2) == pytest.approx(0.0, abs=1e-9)
    assert (above[2] - above[1]) == pytest.approx(2 * (above[1] - above[0]))


def made(read, seed):
    """Records of a first-order machine whose sensor reads so; the last one is held out."""
    rng = np.random.default_rng(seed)
    x = free_run(velocity(), u := steps(rng, (4, 200)), 0.1)[0]
    records = experiments(u, read(x) + 0.01 * rng.standard_normal(x.shape), 0.1)
    return records[:3], records[3:]


def test_a_sensor_whose_gain_trebles_at_one_place_has_a_fine_curve():
    trial = selected(*made(lambda x: np.where(x < 0.3, 0.5 * x, 1.5 * x - 0.3), 0), "other")
    found = {term.effect.name: type(term.effect) for term in trial.terms}
    assert found["curved_sensor"] is FinelyCurvedSensor
    part = trial.estimate.plant.part_of(next(t for t in trial.terms if t.effect.name == "curved_sensor"))
    gains = trial.estimate.theta[part][:7]
    assert gains[-2:].mean() == pytest.approx(3 * gains[:3].mean(), rel=0.15)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_sensor_of_two_numbers_keeps_them(seed):
    trial = selected(*made(lambda x: x + 0.3 * x * x, seed), "other")
    assert [type(term.effect) for term in trial.terms] == [CurvedSensor]
