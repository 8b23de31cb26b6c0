"""The contract that every registered model keeps: a new model gets all of these by its one decorator."""

from dataclasses import replace

import pytest

from simgap.contract import CHECKS, candidate
from simgap.data.simulated.gimbal.recordings import gimbal_short
from simgap.protocol import is_stochastic
from simgap.registry import MODELS

# The search over many orders takes half a minute, and is the same code.
FEWER_ORDERS = {"box-jenkins": {"max_order": 2}}


@pytest.fixture(scope="module", params=MODELS.names())
def model(request):
    if reason := MODELS.why_missing(request.param):
        pytest.skip(reason)
    return candidate(request.param, FEWER_ORDERS.get(request.param))


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_every_model_keeps_the_contract(check, model):
    check(model)


@pytest.mark.parametrize(
    "name",
    [
        "narx",
        "gru",
        *(pytest.param(x, marks=pytest.mark.slow) for x in ("sindy", "kernel-narx", "n4sid", "hammerstein")),
    ],
)
def test_validation_records_that_are_no_longer_than_the_start_count_as_none(name):
    data = gimbal_short().training
    short = replace(data, valid=tuple(x[: data.n_init] for x in data.valid))
    assert short.held_out == data.train
    model, without = candidate(name).build(), candidate(name).build()
    model.fit(short, 0)
    without.fit(replace(data, valid=()), 0)
    assert model.n_params == without.n_params


@pytest.mark.parametrize(
    ("model", "random"),
    [("delta", {"model": "gru"}), ("ensemble", {"models": ["arx", "gru"]}), ("informed", {"inner": "gru"})],
)
def test_a_model_of_models_says_before_its_fit_whether_the_seed_counts(model, random):
    plain = {key: ["arx"] if isinstance(value, list) else "arx" for key, value in random.items()}
    assert is_stochastic(MODELS[model](**random))
    assert not is_stochastic(MODELS[model](**plain))
