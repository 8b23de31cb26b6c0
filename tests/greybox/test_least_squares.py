"""The fit: its slopes, its step without the numbers that belong to single records, and where it ends."""

import numpy as np
import pytest

from .parts import (
    fitted,
    jacobian,
    model,
    noise_of,
    outputs_of,
    own_numbers,
    records,
    simulated,
    step,
    white_noise,
    whitened,
)
from .plants import free_run, position, steps, velocity

DT = 0.1
MODELS = {
    "plain": model("position", DT, [1.2, 4.0], 3.0, offset=0.5),
    "zeros": model("other", DT, [9.0, 18.0, 1.0], 20.0, offset=-0.3, zeros=(0.2, 0.05)),
    "cascade": model("level", DT, [0.5, 0.3], 0.4, offset=0.1),
    "effects": model("position", DT, [1.2, 4.0], 3.0, ("constant_load", "sensor_lag", "sensor_drift"), True),
    "input": model("velocity", DT, [1.5], 2.0, ("asymmetric_gain", "sensor_bias", "actuator_lag")),
}


def at(known):
    """Records and own numbers to look at a model with; nothing is measured in part of the second record."""
    rng = np.random.default_rng(0)
    ny = outputs_of(known)
    measured = np.ones((3, 40), dtype=bool)
    measured[1, 30:] = measured[2, 7] = False
    data = records(steps(rng, (3, 40)), rng.standard_normal((3, 40, ny)), DT, measured)
    return data, 0.3 * rng.standard_normal((3, own_numbers(known))), white_noise(*[0.5, 2.0][:ny])


@pytest.mark.parametrize("known", MODELS.values(), ids=MODELS)
def test_slopes_are_those_of_central_differences(known):
    data, own, noise = at(known)
    of_theta, of_own = jacobian(known, data, own, noise)

    def white(theta, numbers):
        y = simulated(known, data, numbers, theta)
        return whitened(noise, y * data.mask[:, :, None]).reshape(3, -1)  # [E, M]

    for i, slope in enumerate(of_theta):
        h = 1e-4 * max(abs(known.theta[i]), 0.1) * (np.arange(len(known.theta)) == i)
        expected = (white(known.theta + h, own) - white(known.theta - h, own)) / (2 * h[i])
        assert np.abs(expected).max() > 0
        np.testing.assert_allclose(slope, expected, atol=1e-3 * np.abs(expected).max())
    for i, slope in enumerate(of_own):
        h = 1e-4 * (np.arange(own.shape[1]) == i)
        expected = (white(known.theta, own + h) - white(known.theta, own - h)) / 2e-4
        assert np.abs(expected).max() > 0
        np.testing.assert_allclose(slope, expected, atol=1e-3 * np.abs(expected).max())


def test_slopes_of_coloured_noise_are_whitened_like_the_errors():
    known = MODELS["plain"]
    data, own, _ = at(known)
    noise = noise_of([[1.0, -0.7]], [0.5])
    plain = jacobian(known, data, own, white_noise(1.0))
    for slopes, expected in zip(jacobian(known, data, own, noise), plain, strict=True):
        whole = whitened(noise, expected.reshape(-1, 40, 1)).reshape(expected.shape)
        np.testing.assert_allclose(slopes, whole, atol=1e-9)


@pytest.fixture
def dense():
    """Random slopes of p = 4 shared and q = 2 own numbers in 3 records of 20 samples; J of all 4 + 3 x 2 of them."""
    rng = np.random.default_rng(1)
    of_theta, of_own = (
        rng.standard_normal((4, 3, 20)) * np.array([1, 10, 0.1, 3])[:, None, None],
        rng.random((2, 3, 20)),
    )
    whole = np.zeros((60, 10))
    whole[:, :4] = of_theta.reshape(4, 60).T
    for e in range(3):
        whole[20 * e : 20 * (e + 1), 4 + 2 * e : 6 + 2 * e] = of_own[:, e].T
    return of_theta, of_own, rng.standard_normal((3, 20)), whole


@pytest.mark.parametrize("damping", [0.0, 0.1, 10.0])
def test_the_step_is_that_of_the_normal_equations_of_all_numbers_at_once(dense, damping):
    of_theta, of_own, errors, whole = dense
    (theta, own), _ = step(of_theta, of_own, errors, np.ones(4, dtype=bool), damping)
    hessian = whole.T @ whole
    expected = np.linalg.solve(hessian + damping * np.diag(np.diag(hessian)), whole.T @ errors.ravel())
    np.testing.assert_allclose(theta, expected[:4], rtol=1e-6)
    np.testing.assert_allclose(own.ravel(), expected[4:], rtol=1e-6, atol=1e-9)


def test_the_promised_fall_of_the_squares_is_that_of_linear_regression(dense):
    of_theta, of_own, errors, whole = dense
    _, promised = step(of_theta, of_own, errors, np.ones(4, dtype=bool), 0.0)
    rest = errors.ravel() - whole @ np.linalg.lstsq(whole, errors.ravel(), rcond=None)[0]
    assert promised == pytest.approx(np.vdot(errors, errors) - rest @ rest)


def test_what_is_held_fixed_takes_no_step_and_the_others_step_as_if_it_were_not_there(dense):
    of_theta, of_own, errors, whole = dense
    (theta, own), _ = step(of_theta, of_own, errors, np.array([True, False, True, True]), 0.0)
    expected = np.linalg.lstsq(np.delete(whole, 1, axis=1), errors.ravel(), rcond=None)[0]
    assert theta[1] == 0
    np.testing.assert_allclose(np.r_[theta[[0, 2, 3]], own.ravel()], expected, rtol=1e-5, atol=1e-8)


@pytest.mark.parametrize(
    ("plant", "begun", "true"),
    [
        (velocity(), model("velocity", DT, [0.5], 1.0), [1.5, 2.0]),
        (position(), model("position", DT, [0.6, 6.0], 5.0), [1.2, 4.0, 3.0]),
    ],
    ids=["velocity", "position"],
)
def test_parameters_and_starts_of_data_without_noise_are_found(plant, begun, true):
    rng = np.random.default_rng(2)
    u, start = steps(rng, (3, 80)), rng.standard_normal((3, len(plant.a)))
    y, _ = free_run(plant, u, DT, start)
    theta, own = fitted(begun, records(u, y, DT), white_noise(1e-3))
    np.testing.assert_allclose(theta, true, rtol=1e-4)
    np.testing.assert_allclose(own, start, rtol=1e-3, atol=1e-4)


def test_what_was_not_measured_does_not_pull_the_fit():
    rng = np.random.default_rng(3)
    u = steps(rng, (3, 80))
    y, _ = free_run(velocity(), u, DT)
    measured = rng.random((3, 80)) > 0.2
    measured[:, 0] = True
    data = records(u, np.where(measured[:, :, None], y, 100.0), DT, measured)
    theta, _ = fitted(model("velocity", DT, [0.5], 1.0), data, white_noise(1e-3))
    np.testing.assert_allclose(theta, [1.5, 2.0], rtol=1e-4)


def test_a_parameter_does_not_leave_its_bounds():
    rng = np.random.default_rng(4)
    u = steps(rng, (3, 80))
    opposite = u + 0.1 * np.sign(u)  # a dead zone of less than nothing
    y, _ = free_run(velocity(), opposite, DT)
    theta, _ = fitted(model("velocity", DT, [1.5], 2.0, ("dead_zone",)), records(u, y, DT), white_noise(0.01))
    assert theta[-1] == 0.0
