import numpy as np
import pytest

import simgap
from simgap.baselines.estimation.forward_selection import forward_selection
from simgap.baselines.estimation.levenberg import minimise
from simgap.baselines.estimation.narx_error import NarxError
from simgap.baselines.narx import Narx
from simgap.records import Experiment, TrainingSet


def cubic_plant(seed, length=600):
    """y(t) = 1.2 y(t-1) - 0.5 y(t-2) - 0.05 y(t-1)^3 + 0.4 u(t-1), measured with noise of 0.01."""
    rng = np.random.default_rng(seed)
    u, y = rng.normal(size=length), np.zeros(length)
    for t in range(2, length):
        y[t] = 1.2 * y[t - 1] - 0.5 * y[t - 2] - 0.05 * y[t - 1] ** 3 + 0.4 * u[t - 1]
    return Experiment(f"cubic{seed}", u[:, None], y[:, None] + 0.01 * rng.normal(size=(length, 1)), 1.0)


def test_a_cubic_plant_is_simulated_to_within_its_noise():
    model = Narx(max_lags=3)
    model.fit(TrainingSet((cubic_plant(0), cubic_plant(1)), (cubic_plant(2),), 10), 0)
    test = cubic_plant(3)
    error = model.simulate(test.u[None], test.y[None, :10])[0] - test.y[10:]
    assert np.sqrt(np.mean(error**2)) < 0.0125
    assert model.fitted["degree"] == 3
    assert model.n_params <= 12


def test_forward_selection_takes_the_columns_that_made_the_target_and_no_copies():
    rng = np.random.default_rng(0)
    phi = rng.normal(size=(8, 400))
    phi[5] = phi[2]
    y = 3 * phi[2] - phi[6] + 0.5 * phi[0]
    chosen = forward_selection(phi @ phi.T, phi @ y, 3)
    assert list(chosen) == [2, 6, 0]
    assert not {2, 5} <= set(forward_selection(phi @ phi.T, phi @ y, 8))


def test_the_gradient_of_the_free_run_is_its_slope():
    model = Narx(max_lags=2)
    data = TrainingSet((cubic_plant(0, 200),), (cubic_plant(1, 100),), 5)
    model.fit(data, 0)
    equation = NarxError.of(model.model, data.train, 5)
    theta = 1.01 * model.model.theta
    steps = 1e-6 * np.eye(len(theta))
    slopes = [(equation.squares(theta + step) - equation.squares(theta - step)) / 4e-6 for step in steps]
    np.testing.assert_allclose(equation.cost(theta).gradient, slopes, rtol=1e-4, atol=1e-6)
    assert minimise(equation, theta).cost.squares <= equation.squares(theta)


@pytest.mark.slow
def test_silverbox_is_simulated_no_worse_than_by_the_published_narx(measured):
    """0.640, 2.25 and 0.571 mV (Champneys and others 2024, arXiv 2405.10779)."""
    done = simgap.fit("narx", "silverbox")
    rmse = {r.experiment: r.metrics["y"]["rmse"] for r in done.results if r.task == "free_run"}
    assert rmse["multisine"] < 0.640e-3
    assert rmse["arrow_no_extrapolation"] < 0.571e-3
