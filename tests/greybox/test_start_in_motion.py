"""Records that begin while the input is still on its way: what stood before them is found."""

import numpy as np
import pytest
from scipy.signal import lfilter

from simgap.registry import EFFECTS

from .building import order_of, plain_search, refined
from .parts import experiments
from .plants import free_run, steps, velocity

DT = 0.1  # s
RATE, LAG, DELAY = 1.5, 1.0, 0.4  # 1/s of the plant, s, s
LINEAR = {"input_delay": 240, "actuator_lag": 245, "sensor_lag": 245}  # samples that nobody logged; a step is at 240


def begun_in_motion(effect, noise=0.0):
    """Four records of a first-order plant with a linear effect, cut out of a longer run just behind a step."""
    rng, before = np.random.default_rng(3), LINEAR[effect]
    u = steps(rng, (4, before + 300), hold=40)
    filtered, late = np.exp(-DT / 8 / LAG), round(8 * DELAY / DT)
    fine = np.repeat(u, 8, axis=1)
    if effect == "input_delay":
        fine = np.concatenate((np.repeat(fine[:, :1], late, axis=1), fine[:, :-late]), axis=1)
    if effect == "actuator_lag":
        fine = lfilter([1 - filtered], [1, -filtered], fine, axis=1)
    y = free_run(velocity(RATE), fine, DT / 8)[0]
    if effect == "sensor_lag":
        y = lfilter([1 - filtered], [1, -filtered], y, axis=1)
    y = y[:, ::8][:, before:]
    y = y + noise * y.std() * rng.standard_normal(y.shape)
    return experiments(u[:, before:], y, DT)


@pytest.mark.parametrize("effect", LINEAR)
def test_a_linear_effect_is_fitted_to_its_last_sample_where_it_does_not_begin_settled(effect):
    made = begun_in_motion(effect)
    search = plain_search(made[:3], made[3:], "velocity")
    fit = refined(search, effect)
    value = fit.theta[fit.plant.part_of(fit.plant.terms[0])][0]
    size = np.std(search.train.y)
    if effect == "input_delay":
        assert value == pytest.approx(DELAY, rel=0.02)
    else:  # which pole is the lag's, no linear plant tells
        assert sorted([fit.theta[0], 1 / value]) == pytest.approx([1 / LAG, RATE], rel=0.05)
    assert np.max(np.abs(fit.errors)) < 0.02 * size
    assert np.max(np.abs(fit.local[:, 1])) > 0.1  # of the range of the input, or of the reading


def test_what_stood_before_a_record_does_not_buy_a_higher_order_than_a_delay():
    made = begun_in_motion("input_delay", noise=0.02)
    assert order_of(plain_search(made[:3], made[3:], "other")) == 1


@pytest.mark.parametrize("effect", LINEAR)
def test_nothing_in_memory_means_settled(effect):
    settled_law, law = EFFECTS[effect](), EFFECTS[effect].refined()
    rng = np.random.default_rng(0)
    values, p, t = rng.standard_normal((3, 50)), np.array([0.37, 5.0]), DT * np.arange(50)
    last = t if law.port == "output" else DT
    settled, begun = settled_law.term(values, p[:1], last), law.term_from(values, p, last, np.zeros(3))
    np.testing.assert_array_equal(settled, begun)
    away = law.term_from(values, p, last, np.array([0.0, 0.5, -1.0]))
    assert np.max(np.abs(away - settled), axis=1) == pytest.approx([0.0, 2.5, 5.0], rel=0.25, abs=0.0)
