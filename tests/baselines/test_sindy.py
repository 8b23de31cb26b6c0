import warnings

import numpy as np
import pytest

from simgap.baselines.estimation.monomials import maps, regressors
from simgap.baselines.estimation.narx_error import NarxError
from simgap.baselines.estimation.thresholding import thresholded
from simgap.baselines.sindy import Sindy
from simgap.records import Experiment, TrainingSet


def duffing(seed, length=800, noise=0.0):
    """d2y(t) = -0.1 dy - 0.05 y - 0.05 y^3 + 0.1 u, all of them one sample ago: a hardening spring."""
    rng = np.random.default_rng(seed)
    u, y = np.repeat(rng.normal(size=length // 4), 4), np.zeros(length)
    for t in range(2, length):
        dy = y[t - 1] - y[t - 2]
        y[t] = y[t - 1] + dy - 0.1 * dy - 0.05 * y[t - 1] - 0.05 * y[t - 1] ** 3 + 0.1 * u[t - 1]
    return Experiment(f"duffing{seed}", u[:, None], y[:, None] + noise * rng.normal(size=(length, 1)), 1.0)


def test_the_terms_of_a_hardening_spring_are_found_and_its_numbers_too():
    model = Sindy(max_order=3)
    model.fit(TrainingSet((duffing(0), duffing(1)), (duffing(2),), 10), 0)
    test = duffing(3)
    error = model.simulate(test.u[None], test.y[None, :10])[0] - test.y[10:]
    assert np.abs(error).max() < 1e-3 * test.y.std()
    assert model.fitted["order"] == 2
    assert model.n_params <= 8  # four, and what an operating point adds: 1, y^2, ..


def test_noise_does_not_make_it_run_away():
    model = Sindy(max_order=3)
    noisy = [duffing(seed, noise=0.01) for seed in range(4)]
    model.fit(TrainingSet(tuple(noisy[:2]), (noisy[2],), 10), 0)
    assert not NarxError.of(model.model, noisy[:2], 10).strays()
    error = model.simulate(noisy[3].u[None], noisy[3].y[None, :10])[0] - noisy[3].y[10:]
    assert np.sqrt(np.mean(error**2)) < 0.1 * noisy[3].y.std()


@pytest.mark.parametrize("threshold", [0.05, 0.3])
def test_thresholded_least_squares_are_those_of_pysindy(threshold):
    rng = np.random.default_rng(0)
    phi = rng.normal(size=(300, 8))
    y = phi @ [1.0, 0, -0.5, 0, 0.1, 0, 0, 0.4] + 0.1 * rng.normal(size=300)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from pysindy import STLSQ

        theirs = STLSQ(threshold=threshold, alpha=0.2, unbias=False).fit(phi, y).coef_.ravel()
    np.testing.assert_allclose(thresholded(phi.T @ phi, phi.T @ y, threshold, 0.2), theirs, atol=1e-10)


def test_differences_are_those_of_numpy():
    rng = np.random.default_rng(0)
    u, y = rng.normal(size=(30, 1)), rng.normal(size=(30, 2))
    r = regressors(u, y, 3, 1, differences=True)
    for k in range(3):
        np.testing.assert_allclose(r[2 * k : 2 * k + 2, 5:], np.diff(y, k, axis=0)[7 - k : -1].T)
        np.testing.assert_allclose(r[6 + k, 5:], np.diff(u[:, 0], k)[7 - k : -1])
    past, base = maps(3, True)
    np.testing.assert_allclose(y[10] - base @ y[9:6:-1], np.diff(y, 3, axis=0)[7], atol=1e-12)
    assert past.shape == (4, 4)
