"""The contract that every registered model keeps: a new model gets all of these by its one decorator."""

import pytest

from simgap.contract import CHECKS, candidate
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
