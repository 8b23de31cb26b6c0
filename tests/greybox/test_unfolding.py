"""Drives that swing, with a sensor that loses the sign: the order of the plant and the sensor are found together."""

import numpy as np
import pytest

from simgap.greybox import dynamics, pole_search, unfolding
from simgap.greybox.identification import identify
from simgap.greybox.plant import Plant as GreyBox
from simgap.records import TrainingSet

from .parts import channels, experiments, records
from .plants import Plant, free_run, steps

DT = 0.02
SWING, DAMPING, RATE = 22.0, 5.0, 4.0  # rad/s, 1/s, 1/s


def coupled_drives():
    """A slow pole and a resonance, as two motors that drive one pulley by a belt; steady gain of one."""
    c2, c1, c0 = np.polymul([1.0, RATE], [1.0, 2 * DAMPING, SWING**2 + DAMPING**2])[1:]
    return Plant(np.array([[0, 1.0, 0], [0, 0, 1.0], [-c0, -c1, -c2]]), np.array([[0], [0], [c0]]), np.eye(3)[:1])


def poles_of(fit):
    return np.sort_complex(dynamics.poles(fit.plant, fit.theta))


TRUE_POLES = np.sort_complex(np.array([-RATE, -DAMPING - 1j * SWING, -DAMPING + 1j * SWING]))


@pytest.fixture
def recorded():
    u = steps(np.random.default_rng(3), (4, 200), hold=12)
    y, _ = free_run(coupled_drives(), u, DT)
    return u, y


def test_a_resonance_is_found_beside_a_slow_pole_from_the_model_of_lower_order(recorded):
    u, y = recorded
    data, smaller = records(u, y, DT), None
    for order in (1, 2, 3):
        smaller = pole_search.fit_plain(GreyBox("other", order, 1, DT, offset=True), data, smaller)
    np.testing.assert_allclose(poles_of(smaller), TRUE_POLES, rtol=1e-3)


def test_readings_without_a_sign_are_unfolded_by_the_signs_of_a_model(recorded):
    u, y = recorded
    fit = unfolding.unfolded(GreyBox("other", 3, 1, DT, offset=True), records(u, np.abs(y), DT))
    np.testing.assert_allclose(poles_of(fit), TRUE_POLES, rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["velocity", "other"])
def test_order_and_a_sensor_without_a_sign_are_found_together(recorded, kind):
    u, y = recorded
    noisy = np.abs(y) + 0.01 * np.random.default_rng(1).standard_normal(y.shape)
    made = experiments(u, noisy, DT)
    (one,) = identify(TrainingSet(tuple(made[:3]), tuple(made[3:]), 10, channels(kind)))
    assert one.selection.trial.names == ("absolute_sensor",)
    np.testing.assert_allclose(poles_of(one.selection.trial.estimate), TRUE_POLES, rtol=0.05)
