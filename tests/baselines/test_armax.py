"""ARMAX: the prediction-error method, on systems whose truth is known."""

import numpy as np
from scipy.signal import lfilter

from simgap.baselines.armax import Armax
from simgap.baselines.arx import Arx
from simgap.baselines.estimation.gram import lagged_gram
from simgap.baselines.estimation.orders import Orders
from simgap.baselines.estimation.prediction_error import PredictionError
from simgap.records import Experiment, TrainingSet


def noisy_record(seed: int, length: int = 4000) -> Experiment:
    """Order 2 with one coefficient of C."""
    u, e = np.random.default_rng(seed).standard_normal((2, length))
    y = lfilter([0, 1.0, 0.5], [1, -1.5, 0.7], u) + 0.3 * lfilter([1, -0.9], [1, -1.5, 0.7], e)
    return Experiment("e", u[:, None], y[:, None], 1.0)


def test_the_gradient_is_the_slope_of_the_cost():
    rng = np.random.default_rng(1)
    experiments = [Experiment("e", rng.standard_normal((n, 2)), rng.standard_normal((n, 1)), 1.0) for n in (60, 60, 40)]
    orders = Orders.of(1, 2, na=2, nb=2, nk=1, nc=2)
    equation = PredictionError.of(lagged_gram(experiments, np.zeros(3), 2), orders, 0, True)
    theta = np.array([-0.5, 0.2, 1.0, 0.5, 0.3, -1.0, 0.2, 0.6, 0.3])
    steps = 1e-6 * np.eye(len(theta))
    slope = [(equation.squares(theta + d) - equation.squares(theta - d)) / 4e-6 for d in steps]
    np.testing.assert_allclose(equation.cost(theta).gradient, slope, rtol=1e-6)
    np.testing.assert_allclose(equation.cost(theta).squares, equation.squares(theta), rtol=1e-12)


def test_without_noise_polynomial_it_is_arx():
    data = TrainingSet((noisy_record(2),), (), 5)
    armax, arx = Armax(na=2, nb=2, nc=0), Arx(na=2, nb=2)
    armax.fit(data, 0)
    arx.fit(data, 0)
    np.testing.assert_allclose(armax.polynomial.a, arx.polynomial.a, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(armax.result.rows[0].covariance, arx.result.rows[0].covariance, rtol=1e-6)


def test_many_short_experiments_tell_what_one_long_one_does():
    whole = noisy_record(3)
    pieces = tuple(whole[i : i + 200] for i in range(0, 4000, 200))
    for experiments in ((whole,), pieces):
        model = Armax(2, 2, 1)
        model.fit(TrainingSet(experiments, (), 5), 0)
        row = model.result.rows[0]
        assert row.names == ("a1", "a2", "b1", "b2", "c1")
        assert np.abs((row.values - [-1.5, 0.7, 1.0, 0.5, -0.9]) / row.standard_errors).max() < 4


def test_the_noise_polynomial_stays_inside_the_unit_circle():
    rng = np.random.default_rng(4)
    u, e = rng.standard_normal((2, 300))
    y = lfilter([0, 1.0], [1, -0.8], u) + lfilter([1, -1.0], [1], e)  # a true root on the circle
    model = Armax(1, 1, 1)
    model.fit(TrainingSet((Experiment("e", u[:, None], y[:, None], 1.0),), (), 5), 0)
    assert np.abs(np.roots(model.polynomial.c[:, 0, 0])).max() < 1


def test_two_outputs_each_get_their_own_equation():
    rng = np.random.default_rng(5)
    u, e = rng.standard_normal((1500, 1)), 0.1 * rng.standard_normal((1500, 2))
    y = np.zeros((1500, 2))
    for t in range(1, 1500):
        y[t, 0] = 0.8 * y[t - 1, 0] + u[t - 1, 0] + e[t, 0] + 0.5 * e[t - 1, 0]
        y[t, 1] = 0.6 * y[t - 1, 1] + 0.3 * y[t - 1, 0] + e[t, 1] - 0.4 * e[t - 1, 1]
    model = Armax(1, 1, 1)
    model.fit(TrainingSet((Experiment("e", u, y, 1.0),), (), 5), 0)
    np.testing.assert_allclose(model.polynomial.a[1], [[-0.8, 0], [-0.3, -0.6]], atol=0.02)
    np.testing.assert_allclose(np.diag(model.polynomial.c[1]), [0.5, -0.4], atol=0.1)
