from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

import simgap
from simgap.baselines.estimation.block_error import FIELDS, BlockError
from simgap.baselines.estimation.blocks import Blocks
from simgap.baselines.estimation.curve_kernels import basis, spline
from simgap.baselines.hammerstein import Hammerstein
from simgap.baselines.wiener import Wiener
from simgap.baselines.wiener_hammerstein import WienerHammerstein
from simgap.records import Experiment, TrainingSet

NOISE = 0.01
N_INIT = 20


def plant(seed, curve, first, second, length=900, nu=1):
    """Filter, curve, filter, with noise; what comes before the record is cut off."""
    rng = np.random.default_rng(seed)
    u = rng.normal(size=(length + 100, nu))
    x = np.stack([lfilter(*first, u[:, j]) for j in range(nu)], axis=1)
    y = sum(lfilter(*second, curve(x[:, j], j)) for j in range(nu))
    y = y + NOISE * rng.normal(size=len(u))
    return Experiment(f"plant{seed}", u[100:], y[100:, None], 1.0)


def rmse(model, experiment):
    error = model.simulate(experiment.u[None], experiment.y[None, :N_INIT])[0] - experiment.y[N_INIT:]
    return float(np.sqrt(np.mean(error**2)))


def fitted(model, **described):
    experiments = [plant(seed, **described) for seed in range(3)]
    model.fit(TrainingSet(tuple(experiments[:2]), (experiments[2],), N_INIT), 0)
    return model


def test_a_spline_is_smooth_and_straight_outside_its_knots():
    x = np.linspace(-4, 4, 20001)
    c = np.random.default_rng(0).normal(size=9)
    f, slope = spline(x, -2.0, 4 / 6, c)
    np.testing.assert_allclose(c @ basis(x, -2.0, 4 / 6, 9), f, atol=1e-12)
    np.testing.assert_allclose(np.gradient(f, x), slope, atol=1e-3)
    assert np.ptp(slope[x > 2]) == np.ptp(slope[x < -2]) == 0
    np.testing.assert_allclose(basis(x, -2.0, 4 / 6, 9).sum(axis=0), 1.0)


@pytest.mark.parametrize("branches", [1, 2])
def test_the_gradient_is_the_slope_of_the_squares_near_the_plant(branches):
    rng = np.random.default_rng(branches)
    model = Blocks(
        rng.normal(size=(branches, 2, 3)), np.array([1, -1.2, 0.5]), rng.normal(size=(branches, 8)).cumsum(axis=1),
        np.full(branches, -3.0), np.full(branches, 6 / 5), rng.normal(size=(branches, 2)), np.array([1, -0.8]),
        np.zeros(2), 0.0, 0.3, np.ones(branches), 1.0,
    )  # fmt: skip
    u = rng.normal(size=(3, 60, 2))
    y = model.simulate(u, np.zeros((3, 0))) + 0.05 * rng.normal(size=(3, 60))
    records = [Experiment("", u[i], y[i, :, None], 1.0) for i in range(3)]
    equation = BlockError.of(model, records, 0, N_INIT, FIELDS)
    theta = 1.001 * equation.theta
    slopes = [
        (equation.squares(theta + step) - equation.squares(theta - step)) / 4e-5 for step in 1e-5 * np.eye(len(theta))
    ]
    gradient = equation.cost(theta).gradient
    np.testing.assert_allclose(gradient, slopes, atol=1e-3 * np.abs(gradient).max())


@pytest.mark.slow
def test_a_wiener_hammerstein_plant_is_simulated_to_within_its_noise():
    described = {
        "curve": lambda x, j: np.tanh(1.5 * x),
        "first": ([0, 0.5], [1, -0.7]),
        "second": ([1, 0.5], [1, -1.2, 0.6]),
    }
    model = fitted(WienerHammerstein(max_order=2), **described)
    assert rmse(model, plant(9, **described)) < 1.2 * NOISE


def test_a_wiener_plant_is_simulated_to_within_its_noise():
    described = {
        "curve": lambda x, j: np.logaddexp(0, 3 * x),
        "first": ([0, 0.5], [1, -1.2, 0.6]),
        "second": ([1], [1]),
    }
    assert rmse(fitted(Wiener(max_order=2), **described), plant(9, **described)) < 1.3 * NOISE


@pytest.mark.slow
def test_a_hammerstein_plant_with_two_inputs_has_a_curve_for_each():
    described = {"curve": lambda x, j: np.tanh(x) if j else x**2, "first": ([1], [1]),
                 "second": ([0, 0.5, 0.2], [1, -1.2, 0.6]), "nu": 2}  # fmt: skip
    assert rmse(fitted(Hammerstein(max_order=2), **described), plant(9, **described)) < 1.3 * NOISE


def test_the_start_state_is_found_from_the_first_samples():
    described = {"curve": lambda x, j: np.tanh(x), "first": ([0, 0.1], [1, -0.97]), "second": ([1], [1])}
    model = fitted(Wiener(max_order=2), **described)
    late = plant(9, **described)[700:]
    early = late[: N_INIT + 30]
    at_rest = replace(model.outputs[0], noise=1e6)  # trusts no sample
    lost = at_rest.simulate(early.u[None], early.y[None, :N_INIT, 0])[0] - early.y[N_INIT:, 0]
    assert rmse(model, early) < 2 * NOISE < 0.5 * np.sqrt(np.mean(lost**2))


@pytest.mark.slow
def test_the_wiener_hammerstein_benchmark_is_simulated_to_half_a_millivolt(measured):
    """Published: 0.241 mV for SUBNET (Beintema, Schoukens and Toth 2023)."""
    done = simgap.fit("wiener-hammerstein", "wiener_hammerstein")
    (row,) = [r for r in done.results if r.task == "free_run"]
    assert row.metrics["y"]["rmse"] < 0.5e-3
