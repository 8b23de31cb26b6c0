import numpy as np
import pytest
from scipy.signal import lfilter

from simgap.baselines.box_jenkins import BoxJenkins
from simgap.baselines.estimation.box_jenkins_error import BoxJenkinsError
from simgap.baselines.oe import Oe
from simgap.records import Experiment, TrainingSet

F, B = np.poly([0.8 + 0.3j, 0.8 - 0.3j]).real, np.array([0.0, 0.5, 0.3])
C, D = np.array([1.0, 0.5]), np.array([1.0, -0.9])
TRUE = np.concatenate((F[1:], B[1:], C[1:], D[1:]))


def record(seed, length=2000, size=0.3):
    """B/F u + C/D e around an operating point, in the midst of a long run."""
    rng = np.random.default_rng(seed)
    u, e = rng.normal(size=(2, length + 200))
    y = lfilter(B, F, u) + size * lfilter(C, D, e)
    return Experiment(f"bj{seed}", 1 + u[200:, None], 3 + y[200:, None], 1.0)


def fitted(seed=0, **orders):
    model = BoxJenkins(**(orders or {"nb": 2, "nc": 1, "nd": 1, "nf": 2}))
    model.fit(TrainingSet((record(seed),), (), 20), 0)
    return model


def test_the_coefficients_are_those_of_the_plant_within_their_standard_errors():
    off = []
    for seed in range(10):
        (row,) = fitted(seed).result.rows
        off.append((row.values - TRUE) / row.standard_errors)
    assert np.abs(off).max() < 4
    assert 0.5 < np.std(off) < 1.5  # so that the errors stated are the errors made
    assert row.names == ("f1", "f2", "b1", "b2", "c1", "d1")


def test_under_coloured_noise_it_knows_the_plant_better_than_output_error():
    squares = np.zeros(2)
    for seed in range(5):
        data = TrainingSet((record(seed, size=1.0),), (), 20)
        for k, model in enumerate((BoxJenkins(nb=2, nc=1, nd=1, nf=2), Oe(nb=2, nf=2))):
            model.fit(data, 0)
            squares[k] += np.sum((model.result.rows[0].values[:4] - TRUE[:4]) ** 2)
    assert squares[0] < 0.5 * squares[1]


def test_without_a_noise_model_it_is_output_error():
    plain = fitted(nb=2, nc=0, nd=0, nf=2)
    other = Oe(nb=2, nf=2, start="free")
    other.fit(TrainingSet((record(0),), (), 20), 0)
    np.testing.assert_allclose(plain.result.rows[0].values, other.result.rows[0].values, rtol=1e-5)


def test_the_gradient_is_the_slope_of_the_squares():
    model = fitted()
    equation = BoxJenkinsError.of((record(0),), model.result.operating_point, model.result.orders, 0, True)
    theta = 1.01 * equation.theta_of(model.result.rows[0])
    slopes = [(equation.squares(theta + s) - equation.squares(theta - s)) / 4e-6 for s in 1e-6 * np.eye(len(theta))]
    np.testing.assert_allclose(equation.cost(theta).gradient, slopes, rtol=1e-4, atol=1e-3)


def test_a_free_run_is_that_of_b_over_f_once_the_start_has_died_away():
    model, test = fitted(), record(3)
    row, mean = model.result.rows[0], model.polynomial
    f, b = np.r_[1.0, row.values[:2]], np.r_[0.0, row.values[2:4]]
    alone = lfilter(b, f, test.u[:, 0] - mean.u_mean[0]) + mean.y_mean[0]
    free = model.simulate(test.u[None], test.y[None, :20])[0, :, 0]
    np.testing.assert_allclose(free[300:], alone[320:], atol=1e-6)


def test_its_residuals_are_white():
    text = fitted().summary()
    assert "d1" in text
    outside = int(text.split("residual with its own past: ")[1].split()[0])
    assert outside <= 4


def test_orders_belong_together():
    with pytest.raises(ValueError, match="belong together"):
        BoxJenkins(nb=2).fit(TrainingSet((record(0),), (), 20), 0)
