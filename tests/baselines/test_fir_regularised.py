import numpy as np
from scipy.signal import lfilter

from simgap.baselines.estimation.gram import lagged_gram
from simgap.baselines.estimation.kernel_prior import estimate_regularised, stable_spline, tuned_correlated
from simgap.baselines.estimation.orders import Orders
from simgap.baselines.fir import Fir
from simgap.baselines.fir_regularised import FirRegularised
from simgap.records import Experiment, TrainingSet


def short_and_noisy(seed, poles):
    rng = np.random.default_rng(seed)
    u = rng.normal(size=210)
    clean = lfilter([0, 1.0], np.poly(poles), u)
    return Experiment("short", u[:, None], (clean + 0.3 * clean.std() * rng.normal(size=210))[:, None], 1.0)


def response_fit(model, poles):
    """100 (1 - |g - g_hat| / |g - mean|), as Chen, Ohlsson and Ljung (2012) score."""
    g = lfilter([0, 1.0], np.poly(poles), np.eye(1, 60)[0])
    return 100 * (1 - np.linalg.norm(g - model.polynomial.b[:60, 0, 0]) / np.linalg.norm(g - g.mean()))


def test_on_short_noisy_records_the_prior_beats_least_squares():
    rng = np.random.default_rng(0)
    fits = []
    for seed in range(3):
        radius, angle = rng.uniform(0.6, 0.9), rng.uniform(0.2, 1.5)
        poles = [radius * np.exp(1j * angle), radius * np.exp(-1j * angle), rng.uniform(0.3, 0.8)]
        data = TrainingSet((short_and_noisy(seed, poles),), (), 10)
        scores = []
        for model in (FirRegularised(nb=60), Fir(nb=60)):
            model.fit(data, 0)
            scores.append(response_fit(model, poles))
        fits.append(scores)
    regularised, plain = np.array(fits).T
    assert (regularised > plain).all()


def test_the_posterior_mean_solves_the_regularised_normal_equations():
    record = short_and_noisy(3, [0.8, 0.5])
    gram = lagged_gram([record], np.zeros(2), 40)
    (row,) = estimate_regularised(gram, Orders.of(1, 1, nb=40, nk=1)).rows
    u, y = record.u[:, 0], record.y[:, 0]
    phi = np.array([u[40 - k : 210 - k] for k in range(1, 41)])
    phi, y = phi - phi.mean(axis=1, keepdims=True), y[40:] - y[40:].mean()
    # covariance = s2 (phi phi' + s2 P^-1)^-1, so that the mean is covariance phi y / s2.
    np.testing.assert_allclose(row.covariance @ phi @ y / row.variance, row.values, atol=1e-8)


def test_the_kernels_are_positive_and_decay():
    for kernel in (tuned_correlated, stable_spline):
        prior = kernel(30, 0.8)
        assert np.linalg.eigvalsh(prior).min() > -1e-12
        assert (np.diff(np.diag(prior)) < 0).all()
        np.testing.assert_array_equal(prior, prior.T)


def test_an_input_of_few_frequencies_leaves_the_likelihood_computable():
    rng = np.random.default_rng(0)
    spectrum = np.zeros(4097, dtype=complex)
    spectrum[20:1170] = np.exp(2j * np.pi * rng.random(1150))
    u = np.tile(np.fft.irfft(spectrum), 4)
    u *= 50 / u.std()  # so strong that rounding hides the noise wherever the input has no power
    y = lfilter([0.02], [1.0, -0.8], u) + 0.01 * rng.normal(size=len(u))
    record = Experiment("multisine", u[:, None], y[:, None], 1.0)
    model = FirRegularised(nb=60)
    model.fit(TrainingSet((record,), (), 10), 0)
    simulated = model.simulate(record.u[None], record.y[None, :10])[0]
    assert np.std((simulated - record.y[10:])[60:]) < 0.011
