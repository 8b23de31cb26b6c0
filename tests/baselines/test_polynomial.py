"""The one simulation behind all linear models."""

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simgap.baselines.estimation.polynomial import Polynomial


def random_model(seed: int, ny: int, nu: int, order: int, noise: str = "arx") -> Polynomial:
    """Stable A with coupling between outputs, B with direct feed-through, and C as named."""
    rng = np.random.default_rng(seed)
    a = np.zeros((order + 1, ny, ny))
    a[0] = np.eye(ny)
    a[1:] = rng.standard_normal((order, ny, ny)) * 0.4 / max(order * ny, 1)
    b = rng.standard_normal((order + 1, ny, nu))
    c = {"arx": np.zeros_like(a), "oe": a.copy(), "armax": a * 0.5}[noise]
    c[0] = np.eye(ny)
    return Polynomial(a, b, c, rng.standard_normal(nu), rng.standard_normal(ny), 0.1)


def by_hand(model: Polynomial, u: np.ndarray, e: np.ndarray) -> np.ndarray:
    """y(t) = -sum A_k y(t-k) + sum B_k u(t-k) + sum C_k e(t-k) from rest, sample by sample."""
    y = np.zeros((len(u), len(model.y_mean)))
    u = u - model.u_mean
    for t in range(len(u)):
        for k in range(min(t, model.order) + 1):
            y[t] += model.b[k] @ u[t - k] + model.c[k] @ e[t - k] - (model.a[k] @ y[t - k] if k else 0)
    return y + model.y_mean


models = st.builds(
    random_model,
    seed=st.integers(0, 10_000),
    ny=st.integers(1, 3),
    nu=st.integers(1, 2),
    order=st.integers(0, 5),
    noise=st.sampled_from(["arx", "oe", "armax"]),
)


@settings(deadline=None, max_examples=60)
@given(model=models, cut=st.integers(0, 40))
def test_a_noise_free_run_goes_on_exactly_where_the_record_was_cut(model, cut):
    rng = np.random.default_rng(cut)
    u = rng.standard_normal((100, model.b.shape[2]))
    y = by_hand(model, u, np.zeros((100, model.a.shape[1])))
    u, y = u[cut:], y[cut:]  # what came before is unknown now
    n = 12  # more than any state here needs
    simulated = model.simulate(u[None], y[None, :n])[0]
    # An unstable model grows to 1e11, where rounding alone is more than 1e-6.
    np.testing.assert_allclose(simulated, y[n:], rtol=1e-12, atol=1e-6)


@settings(deadline=None, max_examples=40)
@given(model=models)
def test_a_prediction_with_measured_outputs_leaves_only_the_noise(model):
    rng = np.random.default_rng(1)
    u = rng.standard_normal((200, model.b.shape[2]))
    e = rng.standard_normal((200, model.a.shape[1])) * 0.1
    y = by_hand(model, u, e)
    if not np.allclose(model.a, model.c) or model.order == 0:
        error = y - model.predict(u[None], y[None])[0]
        # The start state is estimated from the record, so the first errors are a little smaller than the noise.
        np.testing.assert_allclose(error[120:], e[120:], atol=2e-3)


@settings(deadline=None, max_examples=30)
@given(model=models, n=st.integers(1, 8))
def test_simulating_a_batch_equals_simulating_one_by_one(model, n):
    rng = np.random.default_rng(2)
    u = rng.standard_normal((4, 30, model.b.shape[2]))
    y_init = rng.standard_normal((4, n, model.a.shape[1]))
    together = model.simulate(u, y_init)
    alone = [model.simulate(u[i : i + 1], y_init[i : i + 1])[0] for i in range(4)]
    np.testing.assert_allclose(together, alone, atol=1e-12)


@pytest.mark.parametrize(("ny", "nu"), [(1, 1), (1, 2), (2, 2)])
def test_python_control_answers_as_the_simulation_does(ny, nu):
    model = random_model(3, ny, nu, order=3)
    u = np.random.default_rng(3).standard_normal((50, nu))
    u[:10] = model.u_mean  # at rest at the operating point
    response = control.forced_response(model.to_control(), U=(u - model.u_mean).T).outputs
    response = response.reshape(ny, -1).T + model.y_mean
    y_init = np.tile(model.y_mean, (10, 1))
    np.testing.assert_allclose(model.simulate(u[None], y_init[None])[0], response[10:], atol=1e-10)


def test_a_start_from_one_sample_is_that_of_a_machine_at_rest():
    model = Polynomial(
        np.array([1.0, -0.9, 0.2, 0.0]).reshape(-1, 1, 1),
        np.array([0.0, 0.3, 0.0, 0.0]).reshape(-1, 1, 1),
        np.array([1.0, 0.0, 0.0, 0.0]).reshape(-1, 1, 1),
        np.zeros(1),
        np.zeros(1),
        1.0,
    )
    # Gain 1: an input held at 2 keeps an output that starts at 2.
    simulated = model.simulate(np.full((1, 20, 1), 2.0), np.full((1, 1, 1), 2.0))
    np.testing.assert_allclose(simulated, 2.0, atol=1e-12)


def test_poles_are_the_roots_of_a():
    a = np.poly([0.9, -0.5]).reshape(-1, 1, 1)
    model = Polynomial(a, np.zeros((3, 1, 1)), np.eye(1, 3).reshape(3, 1, 1), np.zeros(1), np.zeros(1), 1.0)
    np.testing.assert_allclose(np.sort(model.poles), [-0.5, 0.9], atol=1e-12)
