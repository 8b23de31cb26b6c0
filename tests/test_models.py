"""The contract that every registered model keeps: a new model gets all of these by its one decorator."""

import copy

import numpy as np
import pytest
from scipy.signal import lfilter

from simgap.protocol import Model
from simgap.records import Experiment, TrainingSet
from simgap.registry import MODELS

N_INIT = 10


def toy_experiment(seed: int, length: int = 160) -> Experiment:
    """A damped second-order plant with two outputs, one input and a little noise."""
    rng = np.random.default_rng(seed)
    u = lfilter([1], [1, -0.5], rng.standard_normal(length))
    position = lfilter([0, 0.3, 0.2], [1, -1.3, 0.5], u)
    outputs = np.stack((position, np.gradient(position)), axis=1)
    return Experiment(f"toy{seed}", u[:, None], outputs + 0.01 * rng.standard_normal((length, 2)), 0.1)


def training_set(first: int = 0) -> TrainingSet:
    return TrainingSet(tuple(toy_experiment(first + i) for i in range(4)), (toy_experiment(first + 4),), n_init=N_INIT)


def simulate(model: Model, experiment: Experiment) -> np.ndarray:
    return model.simulate(experiment.u[None].copy(), experiment.y[None, :N_INIT].copy())[0]


@pytest.fixture(scope="module", params=MODELS.names())
def name(request):
    if reason := MODELS.why_missing(request.param):
        pytest.skip(reason)
    return request.param


def built(name: str) -> Model:
    """The model as it is, but a network that is trained for a second instead of half a minute."""
    kind = MODELS[name]
    return kind(epochs=6, batches=20) if hasattr(kind, "epochs") else kind()


@pytest.fixture(scope="module")
def model(name):
    fitted = built(name)
    fitted.fit(training_set(), seed=0)
    return fitted


def test_it_is_a_model(model):
    assert isinstance(model, Model)
    assert type(model).__doc__


def test_it_returns_the_rows_after_the_start_as_float64(model):
    experiment = toy_experiment(9)
    simulated = simulate(model, experiment)
    assert simulated.shape == (len(experiment) - N_INIT, 2)
    assert simulated.dtype == np.float64
    assert np.isfinite(simulated).all()


def test_a_batch_equals_one_by_one(model):
    experiments = [toy_experiment(20 + i) for i in range(3)]
    u, y = (np.stack([getattr(e, column) for e in experiments]) for column in ("u", "y"))
    together = model.simulate(u, y[:, :N_INIT])
    alone = np.stack([simulate(model, e) for e in experiments])
    np.testing.assert_allclose(together, alone, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("at", [N_INIT, 60, 120])
def test_a_change_of_the_input_changes_nothing_before_it(model, at):
    experiment = toy_experiment(9)
    later = experiment.u.copy()
    later[at:] += 1.0
    before = simulate(model, experiment)[: at - N_INIT]
    after = simulate(model, Experiment("later", later, experiment.y, experiment.dt))[: at - N_INIT]
    np.testing.assert_allclose(before, after, rtol=1e-12, atol=1e-12)


def test_it_sees_no_measured_output_after_the_start(model):
    experiment = toy_experiment(9)
    hidden = experiment.y.copy()
    hidden[N_INIT:] = 1e6
    np.testing.assert_array_equal(
        simulate(model, experiment),
        simulate(model, Experiment("hidden", experiment.u, hidden, experiment.dt)),
    )


def test_it_leaves_its_inputs_as_they_were(model):
    experiment = toy_experiment(9)
    u, y_init = experiment.u[None].copy(), experiment.y[None, :N_INIT].copy()
    given = copy.deepcopy((u, y_init))
    model.simulate(u, y_init)
    np.testing.assert_array_equal((u, y_init)[0], given[0])
    np.testing.assert_array_equal(y_init, given[1])


def test_the_same_seed_gives_the_same_numbers(name, model):
    again = built(name)
    again.fit(training_set(), seed=0)
    np.testing.assert_array_equal(simulate(again, toy_experiment(9)), simulate(model, toy_experiment(9)))


def test_a_second_fit_forgets_the_first(name, model):
    twice = built(name)
    twice.fit(training_set(first=50), seed=0)
    twice.fit(training_set(), seed=0)
    np.testing.assert_array_equal(simulate(twice, toy_experiment(9)), simulate(model, toy_experiment(9)))


def test_it_starts_from_a_single_sample_and_from_many(model):
    experiment = toy_experiment(9)
    for n in (1, 2, 40):
        simulated = model.simulate(experiment.u[None], experiment.y[None, :n])
        assert simulated.shape == (1, len(experiment) - n, 2)
        assert np.isfinite(simulated).all()


def test_it_beats_holding_the_last_value(name, model):
    if name in ("mean", "hold"):
        pytest.skip("this is what the others must beat")
    errors, held = [], []
    for experiment in (toy_experiment(30), toy_experiment(31)):
        measured = experiment.y[N_INIT:]
        errors.append(np.mean((simulate(model, experiment) - measured) ** 2))
        held.append(np.mean((experiment.y[N_INIT - 1] - measured) ** 2))
    assert np.mean(errors) < 0.5 * np.mean(held)
