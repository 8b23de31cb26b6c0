"""The contract that every registered model keeps: a new model gets all of these by its one decorator."""

import pytest

from simgap.contract import CHECKS, candidate
from simgap.registry import MODELS


@pytest.fixture(scope="module", params=MODELS.names())
def model(request):
    if reason := MODELS.why_missing(request.param):
        pytest.skip(reason)
    return candidate(request.param)


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_every_model_keeps_the_contract(check, model):
    check(model)
