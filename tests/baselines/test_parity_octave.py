"""ARX beside Octave's arx and a plain least-squares solution, on simulated and on measured data."""

import numpy as np
import pytest
from scipy.signal import lfilter

from simgap.baselines.arx import Arx
from simgap.baselines.estimation.equation_error import estimate_arx
from simgap.baselines.estimation.gram import lagged_gram
from simgap.baselines.estimation.orders import Orders
from simgap.data import Missing, load
from simgap.records import Experiment, TrainingSet

# Orders in use for these plants; for the Wiener-Hammerstein circuit those of its published ARX baseline.
# Beyond nk = 1, Octave's first equation is ours only where nb = na: it starts at nk - 1 + max(na, nb).
MEASURED = {
    "cascaded_tanks": (4, 4, 1),
    "wiener_hammerstein": (10, 10, 1),
    "silverbox": (4, 4, 1),
    "ced": (3, 3, 1),  # two experiments
    "daisy_hairdryer": (4, 4, 3),
}
SIMULATED = ("three experiments", "three inputs", "two outputs")


def simulated(ny: int, nu: int, length: int, seed: int) -> Experiment:
    """One experiment of outputs that do not act on each other, with noise and a past."""
    rng = np.random.default_rng(seed)
    u = rng.standard_normal((length + 100, nu))
    y = np.empty((length + 100, ny))
    for i in range(ny):
        a = np.poly([0.9 - 0.2 * i, 0.5 + 0.3j, 0.5 - 0.3j]).real
        driven = sum(lfilter(rng.standard_normal(4) * [0, 0, 1, 1], a, u[:, j]) for j in range(nu))
        y[:, i] = driven + lfilter([1.0], a, 0.1 * rng.standard_normal(length + 100))
    return Experiment(f"{seed}", u[100:], y[100:], 0.1)


def deviations(name: str) -> tuple[Experiment, ...]:
    """Measured training records about their mean, since Octave's arx has no constant."""
    records = load(name).training.train
    u, y = (np.concatenate([getattr(e, signal) for e in records]).mean(axis=0) for signal in "uy")
    return tuple(Experiment(e.name, e.u - u, e.y - y, e.dt) for e in records)


@pytest.fixture(scope="module")
def problems(arx_problem) -> dict[str, object]:
    """Every system whose data are here."""
    three = tuple(simulated(1, 1, length, length) for length in (300, 500, 200))
    found = {
        "three experiments": arx_problem(three, [3], [[3]], 2),
        "three inputs": arx_problem((simulated(1, 3, 2000, 1),), [3], [[2, 3, 2]], 1),
        "two outputs": arx_problem((simulated(2, 2, 1000, 2),), [3, 3], [[2, 3], [3, 1]], 1),
    }
    for name, (na, nb, nk) in MEASURED.items():
        try:
            found[name] = arx_problem(deviations(name), [na], [[nb]], nk)
        except Missing:
            continue
    return found


@pytest.fixture(scope="module")
def in_octave(problems, arx_in_octave) -> dict[str, list[np.ndarray]]:
    return dict(zip(problems, arx_in_octave(list(problems.values())), strict=True))


@pytest.fixture(params=[*SIMULATED, *MEASURED])
def name(request, problems) -> str:
    if request.param not in problems:
        pytest.skip(f"{request.param} is not at hand: simgap data fetch {request.param}")
    return request.param


def ours(problem) -> list[np.ndarray]:
    """theta of each output, by the estimator and by the model, which must agree to the last bit."""
    experiments, na = problem.experiments, np.diag(problem.na).tolist()
    orders = Orders.of(*np.shape(problem.nb), na=na, nb=problem.nb, nk=problem.nk)
    gram = lagged_gram(experiments, np.zeros(sum(np.shape(problem.nb))), orders.max_lag)
    model = Arx(na=na, nb=problem.nb, nk=problem.nk, offset=False)
    model.fit(TrainingSet(experiments, (), 20), 0)
    estimated = [row.values for row in estimate_arx(gram, orders, constant=False).rows]
    np.testing.assert_array_equal(np.concatenate(estimated), np.concatenate([r.values for r in model.result.rows]))
    return estimated


def by_hand(problem, output: int) -> np.ndarray:
    """theta of one output from the whole regressor matrix, every experiment on its own rows."""
    na, nb, nk = problem.na[output], problem.nb[output], problem.nk
    lags = max(*problem.na, max(map(max, problem.nb)) + nk - 1)
    blocks, targets = [], []
    for e in problem.experiments:
        past = [-e.y[lags - k : len(e) - k, output] for k in range(1, na + 1)]
        past += [e.u[lags - k : len(e) - k, j] for j in range(len(nb)) for k in range(nk, nk + nb[j])]
        blocks.append(np.stack(past, axis=1))
        targets.append(e.y[lags:, output])
    return np.linalg.lstsq(np.concatenate(blocks), np.concatenate(targets), rcond=None)[0]


def test_arx_equals_octave_to_nine_digits(name, problems, in_octave):
    for theta, expected in zip(ours(problems[name]), in_octave[name], strict=True):
        np.testing.assert_allclose(theta, expected, rtol=1e-9)


def test_arx_equals_plain_least_squares_to_nine_digits(name, problems):
    for i, theta in enumerate(ours(problems[name])):
        np.testing.assert_allclose(theta, by_hand(problems[name], i), rtol=1e-9)


def test_an_offset_is_the_weight_of_a_constant_input_in_octave(arx_problem, arx_in_octave, measured):
    records = load("cascaded_tanks").training.train
    with_ones = tuple(Experiment(e.name, np.hstack((e.u, np.ones_like(e.u))), e.y, e.dt) for e in records)
    expected = arx_in_octave([arx_problem(with_ones, [4], [[4, 1]], 1)])[0][0]
    model = Arx(4, 4, 1)
    model.fit(TrainingSet(records, (), 20), 0)
    fitted = model.polynomial
    constant = fitted.a[:, 0, 0].sum() * fitted.y_mean[0] - fitted.b[:, 0, 0].sum() * fitted.u_mean[0]
    np.testing.assert_allclose([*model.result.rows[0].values, constant], expected, rtol=1e-9)
