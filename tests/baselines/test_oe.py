"""Output error: least squares on the simulation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from simgap.baselines.arx import Arx
from simgap.baselines.estimation.orders import Orders
from simgap.baselines.estimation.output_error import OutputError
from simgap.baselines.oe import Oe
from simgap.records import Experiment, TrainingSet, UnusableInput


def second_order(rng: np.random.Generator, length: int, noise: float) -> Experiment:
    """Output error of order 2 whose past is not zero."""
    u = rng.standard_normal(length + 50)
    y = lfilter([0, 1.0, 0.5], [1, -1.5, 0.7], u) + noise * rng.standard_normal(length + 50)
    return Experiment("e", u[50:, None], y[50:, None], 0.1)


TRUTH = np.array([-1.5, 0.7, 1.0, 0.5])


@pytest.mark.parametrize("start", ["free", "n_init"])
def test_a_noise_free_system_is_recovered(start):
    rng = np.random.default_rng(0)
    model = Oe(2, 2, start=start)
    model.fit(TrainingSet(tuple(second_order(rng, 150, 0.0) for _ in range(3)), (), 8), 0)
    assert model.result.rows[0].names == ("f1", "f2", "b1", "b2")
    np.testing.assert_allclose(model.result.rows[0].values, TRUTH, atol=1e-8)


def test_white_noise_on_the_output_biases_arx_and_not_oe():
    rng = np.random.default_rng(1)
    data = TrainingSet((second_order(rng, 4000, 1.0),), (), 20)
    oe, arx = Oe(2, 2, start="free"), Arx(2, 2)
    oe.fit(data, 0)
    arx.fit(data, 0)
    row = oe.result.rows[0]
    assert np.abs((row.values - TRUTH) / row.standard_errors).max() < 4
    assert np.abs(arx.result.rows[0].values[:2] - TRUTH[:2]).max() > 0.05


def test_with_free_starts_the_standard_errors_are_right():
    rng = np.random.default_rng(2)
    standardised = []
    for _ in range(150):
        model = Oe(2, 2, start="free")
        model.fit(TrainingSet((second_order(rng, 200, 0.7), second_order(rng, 120, 0.7)), (), 8), 0)
        row = model.result.rows[0]
        standardised.append((row.values - TRUTH) / row.standard_errors)
    assert np.var(standardised) == pytest.approx(1.0, abs=0.2)


@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 1000), n_start=st.sampled_from([None, 8, 20]))
def test_the_gradient_is_the_slope_of_the_cost(seed, n_start):
    rng = np.random.default_rng(seed)
    experiments = [Experiment("e", rng.standard_normal((n, 2)), rng.standard_normal((n, 1)), 1.0) for n in (60, 60, 40)]
    orders = Orders.of(1, 2, nb=2, nk=1, nf=[[2, 1]])
    equation = OutputError.of(experiments, np.zeros(3), orders, 0, True, n_start)
    theta = np.array([-0.5, 0.2, 1.0, 0.5, 0.3, -1.0, 0.2, 0.1])
    steps = 1e-6 * np.eye(len(theta))
    slope = [(equation.squares(theta + d) - equation.squares(theta - d)) / 4e-6 for d in steps]
    np.testing.assert_allclose(equation.cost(theta).gradient, slope, rtol=1e-5, atol=1e-4)
    np.testing.assert_allclose(equation.cost(theta).squares, equation.squares(theta), rtol=1e-12)


def test_each_input_has_its_own_denominator():
    rng = np.random.default_rng(3)
    u = rng.standard_normal((800, 2))
    y = lfilter([0, 1.0], [1, -0.9], u[:, 0]) + lfilter([0, 0, 2.0], [1, -0.3], u[:, 1])
    model = Oe(nb=1, nf=1, nk=[[1, 2]])
    model.fit(TrainingSet((Experiment("e", u, y[:, None], 1.0),), (), 10), 0)
    assert model.result.rows[0].names == ("f1_1", "b1_1", "f1_2", "b2_2")
    np.testing.assert_allclose(model.result.rows[0].values, [-0.9, 1.0, -0.3, 2.0], atol=1e-8)
    simulated = model.simulate(u[None], y[None, :10, None])
    np.testing.assert_allclose(simulated[0, :, 0], y[10:], atol=1e-6)


def test_an_integrator_is_identified_without_leaving_the_unit_circle():
    rng = np.random.default_rng(4)
    experiments = []
    for _ in range(4):
        u = rng.standard_normal(300)
        y = np.cumsum(np.concatenate(([rng.normal(0, 50)], u[:-1]))) + 0.1 * rng.standard_normal(300)
        experiments.append(Experiment("e", u[:, None], y[:, None], 1.0))
    model = Oe(1, 1)
    model.fit(TrainingSet(tuple(experiments), (), 5), 0)
    assert abs(model.polynomial.poles[0]) <= 1
    assert model.polynomial.poles[0].real == pytest.approx(1.0, abs=1e-3)


def test_an_output_without_any_input_is_refused():
    rng = np.random.default_rng(5)
    data = TrainingSet((Experiment("e", rng.standard_normal((50, 1)), rng.standard_normal((50, 2)), 1.0),), (), 5)
    with pytest.raises(UnusableInput, match="no input acts on output 2"):
        Oe(nb=[[1], [0]], nf=1).fit(data, 0)
