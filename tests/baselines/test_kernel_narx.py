import numpy as np
import pytest

import simgap
from simgap.baselines.estimation.kernel_regression import Regression, pivoted_cholesky
from simgap.baselines.kernel_narx import KernelNarxModel
from simgap.records import Experiment, TrainingSet


def plant(seed, length=500, noise=0.005):
    """y(t) = 0.8 sin(y(t-1)) + 0.3 y(t-2) exp(-y(t-1)^2) + tanh(u(t-1)), no polynomial, and a little noise."""
    rng = np.random.default_rng(seed)
    u, y = rng.normal(size=length), np.zeros(length)
    for t in range(2, length):
        y[t] = 0.8 * np.sin(y[t - 1]) + 0.3 * y[t - 2] * np.exp(-(y[t - 1] ** 2)) + np.tanh(u[t - 1])
    return Experiment(f"plant{seed}", u[:, None], y[:, None] + noise * rng.normal(size=(length, 1)), 1.0)


def test_a_plant_that_is_no_polynomial_is_simulated_to_a_few_percent():
    model = KernelNarxModel(max_lags=3, max_centres=150)
    model.fit(TrainingSet((plant(0), plant(1)), (plant(2, 300),), 10), 0)
    test = plant(3)
    error = model.simulate(test.u[None], test.y[None, :10])[0] - test.y[10:]
    assert np.sqrt(np.mean(error**2)) < 0.03 * test.y.std()
    assert len(model.model.centres) <= 150


def test_all_rows_as_centres_give_the_posterior_mean_of_a_gaussian_process():
    rng = np.random.default_rng(0)
    r, y, gamma, ridge = rng.normal(size=(40, 2)), rng.normal(size=(40, 1)), 0.4, 0.1
    regression = Regression.of(r, y, gamma, 40, 40)
    linear, weights = regression.solution(ridge)
    at = rng.normal(size=(7, 2))

    def kernel(a, b, with_linear=True):
        squares = np.sum((a[:, None] - b) ** 2, axis=2)
        return np.exp(-gamma * squares) + with_linear * 100.0 * (1 + a @ b.T)

    expected = kernel(at, r) @ np.linalg.solve(kernel(r, r) + ridge * np.eye(40), y)
    ours = np.c_[np.ones(7), at] @ linear + kernel(at, regression.centres, False) @ weights
    np.testing.assert_allclose(ours, expected, atol=1e-6)


def test_pivots_factor_the_kernel_and_leave_out_copies():
    rng = np.random.default_rng(1)
    r = rng.normal(size=(30, 2))
    r[20:] = r[:10]
    chosen, root = pivoted_cholesky(r, 0.5, 30)
    assert len(chosen) == 20
    kernel = np.exp(-0.5 * np.sum((r[chosen][:, None] - r[chosen]) ** 2, axis=2))
    np.testing.assert_allclose(root @ root.T, kernel, atol=1e-8)


@pytest.mark.slow
def test_silverbox_is_simulated_about_as_well_as_by_the_published_gp(measured):
    """0.301, 0.60 and 0.259 mV (Champneys and others 2024, arXiv 2405.10779)."""
    done = simgap.fit("kernel-narx", "silverbox")
    rmse = {r.experiment: r.metrics["y"]["rmse"] for r in done.results if r.task == "free_run"}
    assert rmse["multisine"] < 0.4e-3
