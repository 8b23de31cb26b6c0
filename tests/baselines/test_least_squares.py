"""Least squares without the regressor matrix, against least squares with it."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from simgap.baselines.estimation import gram as gram_module
from simgap.baselines.estimation.gram import lagged_gram, rough_means
from simgap.baselines.estimation.least_squares import solve
from simgap.records import Experiment


def regressors(experiments, columns, target, lags):
    """The matrix that our code never builds: one row per predicted sample of every experiment."""
    rows, targets = [], []
    for e in experiments:
        signals = np.hstack((e.y, e.u))
        rows.append(np.stack([signals[lags - k : len(e) - k, s] for s, k in columns], axis=1))
        targets.append(signals[lags - target[1] : len(e) - target[1], target[0]])
    return np.concatenate(rows), np.concatenate(targets)


def random_experiments(seed, lengths, ny=1, nu=1, level=0.0):
    rng = np.random.default_rng(seed)
    return [
        Experiment(f"e{i}", rng.standard_normal((n, nu)) + level, rng.standard_normal((n, ny)) + level, 1.0)
        for i, n in enumerate(lengths)
    ]


@settings(deadline=None, max_examples=60)
@given(
    seed=st.integers(0, 1000),
    lengths=st.lists(st.integers(1, 60), min_size=1, max_size=4),
    lags=st.integers(0, 6),
    level=st.sampled_from([0.0, 5.0]),
)
def test_the_gram_matrix_is_that_of_the_stacked_regressors(seed, lengths, lags, level):
    experiments = random_experiments(seed, lengths, ny=2, nu=1, level=level)
    shift = rough_means(experiments)
    gram = lagged_gram(experiments, shift, lags)
    shifted = [Experiment(e.name, e.u - shift[2:], e.y - shift[:2], 1.0) for e in experiments if len(e) > lags]
    columns = [(s, k) for s in range(3) for k in range(lags + 1)]
    if not shifted:
        assert gram.rows == 0
        return
    x, _ = regressors(shifted, columns, (0, 0), lags)
    np.testing.assert_allclose(gram.products.reshape(len(columns), -1), x.T @ x, atol=1e-10)
    np.testing.assert_allclose(gram.sums.ravel(), x.sum(axis=0), atol=1e-10)
    assert gram.rows == len(x)


def test_a_record_longer_than_one_piece_gives_the_same_sums(monkeypatch):
    experiments = random_experiments(0, [1000, 333])
    whole = lagged_gram(experiments, np.zeros(2), 4)
    monkeypatch.setattr(gram_module, "CHUNK", 64)
    pieces = lagged_gram(experiments, np.zeros(2), 4)
    np.testing.assert_allclose(pieces.products, whole.products, rtol=1e-12)
    np.testing.assert_allclose(pieces.sums, whole.sums, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("constant", [False, True])
@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 1000), level=st.sampled_from([0.0, 3.0, 1000.0]))
def test_the_solution_is_that_of_lstsq_with_or_without_a_constant(constant, seed, level):
    experiments = random_experiments(seed, [80, 50], level=level)
    columns = [(0, 1), (0, 2), (1, 1), (1, 3)]
    x, y = regressors(experiments, columns, (0, 0), 3)
    if constant:
        x = np.hstack((x, np.ones((len(x), 1))))
    expected = np.linalg.lstsq(x, y, rcond=None)[0]
    shift = rough_means(experiments, constant)
    estimate = solve(lagged_gram(experiments, shift, 3), (0, 0), columns, constant)
    np.testing.assert_allclose(estimate.theta, expected[:4], rtol=1e-9, atol=1e-11)
    residual = y - x @ expected
    assert estimate.variance == pytest.approx(residual @ residual / (len(y) - x.shape[1]), rel=1e-9)


def exact_solution(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Normal equations in rational arithmetic: no rounding at all."""
    columns = [[Fraction(float(v)) for v in column] for column in np.column_stack((x, y)).T]
    p = x.shape[1]
    rows = [[sum(a * b for a, b in zip(columns[i], columns[j], strict=True)) for j in range(p + 1)] for i in range(p)]
    for i in range(p):
        rows[i] = [v / rows[i][i] for v in rows[i]]
        for j in range(p):
            if j != i:
                factor = rows[j][i]
                rows[j] = [a - factor * b for a, b in zip(rows[j], rows[i], strict=True)]
    return np.array([float(row[-1]) for row in rows])


@pytest.mark.parametrize("closeness", [1e-1, 1e-3, 1e-4, 1e-6, 1e-8])
def test_nearly_collinear_regressors_lose_no_more_digits_than_qr(closeness):
    rng = np.random.default_rng(5)
    u = rng.standard_normal((120, 1))
    both = np.hstack((u, u + closeness * rng.standard_normal((120, 1))))
    y = lfilter([0, 1], [1, -0.7], both[:, 0])[:, None] + 0.01 * rng.standard_normal((120, 1))
    experiments = [Experiment("e", both, y, 1.0)]
    columns = [(0, 1), (1, 1), (2, 1)]
    x, target = regressors(experiments, columns, (0, 0), 1)
    exact = exact_solution(x, target)
    q, r = np.linalg.qr(x)
    error_of_qr = np.abs(np.linalg.solve(r, q.T @ target) - exact).max()
    estimate = solve(lagged_gram(experiments, np.zeros(3), 1), (0, 0), columns, constant=False)
    error = np.abs(estimate.theta - exact).max()
    # Both are rounding noise of one size; a plain solution of the normal equations misses by cond^2.
    assert error <= 20 * error_of_qr + 1e-13 * np.abs(exact).max()


def test_dependent_regressors_are_counted_and_still_solved():
    rng = np.random.default_rng(0)
    u = np.repeat(rng.standard_normal((50, 1)), 2, axis=1)  # two inputs that are one
    y = 0.5 * np.roll(u[:, :1], 1, axis=0)
    experiments = [Experiment("e", u, y, 1.0)]
    estimate = solve(lagged_gram(experiments, np.zeros(3), 1), (0, 0), [(1, 1), (2, 1)], constant=False)
    assert estimate.rank == 1
    np.testing.assert_allclose(estimate.theta, [0.25, 0.25], atol=1e-9)
