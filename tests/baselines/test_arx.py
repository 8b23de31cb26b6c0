"""ARX and FIR: least squares over several experiments."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from simgap.baselines.arx import Arx
from simgap.baselines.estimation.linear import IdentificationWarning, simplest
from simgap.baselines.estimation.polynomial import Polynomial
from simgap.baselines.fir import Fir
from simgap.baselines.fir_regularised import FirRegularised
from simgap.records import Experiment, TrainingSet, UnusableInput


def stable_polynomial(rng: np.random.Generator, order: int, largest: float = 0.9) -> np.ndarray:
    pairs, single = divmod(order, 2)
    roots = []
    for _ in range(pairs):
        root = rng.uniform(0.3, largest) * np.exp(1j * rng.uniform(0.2, 2.9))
        roots += [root, root.conjugate()]
    return np.real(np.poly(roots + [rng.uniform(-largest, largest)] * single))


def simulated(
    rng: np.random.Generator, a, b, nk: int, length: int, noise: float = 0.0, level: float = 0.0
) -> Experiment:
    """One experiment of a SISO ARX system whose past is not zero."""
    u = rng.standard_normal(length + 50) + level
    e = noise * rng.standard_normal(length + 50)
    y = lfilter(np.concatenate((np.zeros(nk), b)), a, u) + lfilter([1.0], a, e)
    return Experiment("e", u[50:, None], y[50:, None], 0.1)


@settings(deadline=None, max_examples=50)
@given(seed=st.integers(0, 10_000), na=st.integers(1, 5), nb=st.integers(1, 4), nk=st.integers(0, 3))
def test_a_noise_free_system_is_recovered_to_nine_digits(seed, na, nb, nk):
    rng = np.random.default_rng(seed)
    a, b = stable_polynomial(rng, na), rng.standard_normal(nb) + 0.5
    experiments = tuple(simulated(rng, a, b, nk, length) for length in (200, 150))
    model = Arx(na=na, nb=nb, nk=nk)
    model.fit(TrainingSet(experiments, (), 10), 0)
    estimated = model.polynomial
    np.testing.assert_allclose(estimated.a[: na + 1, 0, 0], a, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(estimated.b[nk : nk + nb, 0, 0], b, rtol=1e-9, atol=1e-9)


def test_arx321_means_three_a_two_b_and_a_delay_of_one():
    rng = np.random.default_rng(0)
    model = Arx(3, 2, 1)
    model.fit(TrainingSet((simulated(rng, [1, -0.5], [1.0], 1, 200, noise=0.1),), (), 5), 0)
    assert model.result.rows[0].names == ("a1", "a2", "a3", "b1", "b2")
    assert model.fitted == {"na": 3, "nb": 2, "nk": 1}
    assert model.n_params == 5


def test_two_inputs_and_two_coupled_outputs_are_recovered():
    rng = np.random.default_rng(1)
    a1 = np.array([[0.5, 0.2], [-0.1, 0.7]])
    b1 = np.array([[1.0, 0.0], [0.3, -0.5]])
    u, y = rng.standard_normal((300, 2)), np.zeros((300, 2))
    for t in range(1, 300):
        y[t] = a1 @ y[t - 1] + b1 @ u[t - 1]
    model = Arx(na=1, nb=[[1, 0], [1, 1]], nk=1)
    model.fit(TrainingSet((Experiment("e", u, y, 1.0),), (), 3), 0)
    np.testing.assert_allclose(model.polynomial.a[1], -a1, atol=1e-10)
    np.testing.assert_allclose(model.polynomial.b[1], b1, atol=1e-10)
    assert model.result.rows[1].names == ("a1_1", "a1_2", "b1_1", "b1_2")


def test_experiments_are_never_glued_together():
    rng = np.random.default_rng(2)
    pieces = [simulated(rng, [1, -0.8], [1.0], 1, 40, level=shift) for shift in (-1.0, 1.0)]
    apart = Arx(1, 1)
    apart.fit(TrainingSet(tuple(pieces), (), 3), 0)
    glued = Experiment("g", np.vstack([e.u for e in pieces]), np.vstack([e.y for e in pieces]), 0.1)
    together = Arx(1, 1)
    together.fit(TrainingSet((glued,), (), 3), 0)
    assert apart.polynomial.a[1, 0, 0] == pytest.approx(-0.8, abs=1e-9)
    assert abs(together.polynomial.a[1, 0, 0] + 0.8) > 1e-3


def test_a_level_in_input_and_output_changes_no_coefficient():
    rng = np.random.default_rng(3)
    e = simulated(rng, [1, -0.9], [0.5], 1, 300, noise=0.2)
    lifted = Experiment("l", e.u + 7.0, e.y - 30.0, e.dt)
    plain, raised = Arx(1, 1), Arx(1, 1)
    plain.fit(TrainingSet((e,), (), 3), 0)
    raised.fit(TrainingSet((lifted,), (), 3), 0)
    np.testing.assert_allclose(raised.polynomial.a, plain.polynomial.a, rtol=1e-9)
    start, after = e.y[None, :3], raised.simulate(lifted.u[None], lifted.y[None, :3])
    np.testing.assert_allclose(after, plain.simulate(e.u[None], start) - 30.0, atol=1e-8)


def test_standard_errors_tell_how_far_the_estimates_are_off():
    rng = np.random.default_rng(4)
    standardised = []
    for _ in range(300):
        e = simulated(rng, [1, -1.2, 0.5], [1.0, 0.4], 1, 400, noise=0.5)
        model = Arx(2, 2, 1)
        model.fit(TrainingSet((e,), (), 3), 0)
        row = model.result.rows[0]
        standardised.append((row.values - [-1.2, 0.5, 1.0, 0.4]) / row.standard_errors)
    # The variance of 1,200 such numbers scatters by about 5 %.
    assert np.var(standardised) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("select", ["bic", "valid"])
def test_the_order_of_a_simulated_system_is_found(select):
    rng = np.random.default_rng(6)
    a = np.poly([0.9, 0.6 + 0.3j, 0.6 - 0.3j]).real
    train, valid = (simulated(rng, a, [1.0, 0.5, 0.2], 2, 3000, noise=0.02) for _ in range(2))
    model = Arx(select=select)
    model.fit(TrainingSet((train,), (valid,), 20), 0)
    assert model.fitted["na"] in (3, 4)
    assert model.fitted["nk"] in (1, 2)


def test_training_data_have_a_say_in_an_order_where_validation_data_tell_little():
    rng = np.random.default_rng(9)
    a = np.poly([0.9, 0.6 + 0.3j, 0.6 - 0.3j]).real
    train = simulated(rng, a, [1.0, 0.5, 0.2], 2, 3000, noise=0.02)
    valid = simulated(rng, a, [1.0, 0.5, 0.2], 2, 60, noise=2.0)
    model = Arx()
    model.fit(TrainingSet((train,), (valid,), 20), 0)
    assert model.fitted["na"] in (3, 4)


def test_a_last_estimate_that_simulates_worse_than_the_chosen_one_is_not_kept():
    rng = np.random.default_rng(13)
    train, valid = (simulated(rng, [1, -0.9], [1.0], 1, 300, noise=0.05) for _ in range(2))
    growing = simulated(rng, [1, -1.02], [1.0], 1, 300)

    class Spoilt(Arx):
        def estimator(self, experiments, n_init, max_lag):
            return super().estimator(experiments if len(experiments) == 1 else [growing], n_init, max_lag)

    model = Spoilt(max_order=1)
    model.fit(TrainingSet((train,), (valid,), 20), 0)
    np.testing.assert_allclose(model.polynomial.a, model.as_chosen().a, atol=1e-3)


def test_a_smaller_model_that_fails_in_one_piece_of_the_data_is_not_as_good_by_chance():
    rng = np.random.default_rng(12)
    record = simulated(rng, [1, -0.9], [0.5], 1, 1000, noise=0.1)
    ones, none = np.ones((1, 1, 1)), np.zeros((1, 1, 1))
    good, growing = (
        Polynomial(
            a=np.concatenate((ones, pole * ones)), b=np.concatenate((none, 0.5 * ones)),
            c=np.concatenate((ones, none)), u_mean=np.zeros(1), y_mean=np.zeros(1), dt=0.1,
        )
        for pole in (-0.9, -1.3)
    )  # fmt: skip
    assert simplest([good, growing], [2, 1], [record], 5) == 0


def test_an_unstable_model_is_announced_with_its_growth():
    rng = np.random.default_rng(7)
    u = rng.standard_normal((60, 1))
    y = lfilter([0, 1.0], [1, -1.1], u[:, 0])[:, None]
    with pytest.warns(IdentificationWarning, match=r"unstable: a pole of magnitude 1\.1 .* tenfold every 24"):
        Arx(1, 1).fit(TrainingSet((Experiment("e", u, y, 1.0),), (), 3), 0)


def test_an_input_that_does_not_excite_the_model_is_announced():
    t = np.arange(200.0)
    u = np.sin(0.3 * t)[:, None]  # one sine shows two coefficients, not eight
    with pytest.warns(IdentificationWarning, match="only 2 of 8 coefficients can be told apart"):
        Fir(nb=8, offset=False).fit(TrainingSet((Experiment("e", u, np.roll(u, 1), 1.0),), (), 3), 0)


def test_too_few_samples_are_refused_with_the_numbers():
    rng = np.random.default_rng(8)
    short = simulated(rng, [1, -0.5], [1.0], 1, 12)
    with pytest.raises(UnusableInput, match="11 coefficients from 7 equations"):
        Arx(5, 5, 1).fit(TrainingSet((short,), (), 3), 0)


def test_an_order_that_reaches_back_beyond_every_experiment_is_refused_before_any_work():
    short = simulated(np.random.default_rng(8), [1, -0.5], [1.0], 1, 50)
    with pytest.raises(UnusableInput, match="reaches 99999 samples back, and the longest experiment has 50"):
        FirRegularised(nb=100_000).fit(TrainingSet((short,), (), 3), 0)


@pytest.mark.parametrize(
    ("orders", "complaint"),
    [
        ({"na": 2}, "belong together"),
        ({"na": -1, "nb": 1}, "not an order"),
        ({"na": [[1, 1]], "nb": 1}, "shape"),
        ({"na": 0, "nb": 0}, "at least one coefficient"),
    ],
)
def test_orders_that_make_no_sense_are_refused(orders, complaint):
    rng = np.random.default_rng(9)
    data = TrainingSet((simulated(rng, [1, -0.5], [1.0], 1, 50),), (), 3)
    with pytest.raises(UnusableInput, match=complaint):
        Arx(**orders).fit(data, 0)


def test_fir_finds_an_impulse_response():
    rng = np.random.default_rng(10)
    response = np.array([0.0, 1.0, 0.5, 0.25])
    u = rng.standard_normal(400)
    y = lfilter(response, [1.0], u)
    model = Fir(nb=4)
    model.fit(TrainingSet((Experiment("e", u[:, None], y[:, None], 1.0),), (), 5), 0)
    np.testing.assert_allclose(model.polynomial.b[:, 0, 0], response, atol=1e-10)
    simulated_outputs = model.simulate(u[None, :, None], y[None, :5, None])
    np.testing.assert_allclose(simulated_outputs[0, :, 0], y[5:], atol=1e-9)
