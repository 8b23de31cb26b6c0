"""One round of the search, followed as its models pass through it."""

import sys
from itertools import groupby

import pytest

from simgap.data.simulated.rigs import hide
from simgap.greybox.fitting import Estimate
from simgap.greybox.linear import find_baseline
from simgap.greybox.search import Search
from simgap.greybox.trial import Trial, assess


def _is_model(value):
    if isinstance(value, list | tuple) and value:
        return _is_model(value[0])
    return isinstance(value, Estimate | Trial)


def _modules_entered(work):
    """Modules of the grey box in which named functions are called with a model, one after the other."""
    entered = []

    def follow(frame, event, _):
        code, module = frame.f_code, frame.f_globals.get("__name__", "")
        if event == "call" and module.startswith("simgap.greybox.") and code.co_name not in ("__init__", "<lambda>"):
            given = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
            if any(_is_model(frame.f_locals.get(name)) for name in given):
                entered.append(module.rpartition(".")[2])

    sys.setprofile(follow)
    try:
        work()
    finally:
        sys.setprofile(None)
    return [module for module, _ in groupby(entered)]


@pytest.mark.slow
def test_models_pass_through_a_round_with_at_most_six_changes_of_module_and_two_returns():
    training = hide("cart", {"coulomb_friction": 1.0}, seed=1).training
    baseline = find_baseline(training.train, training.valid, training.channels, (0,), training.n_init)
    trial, search = assess(baseline, baseline.estimate, 0), Search(baseline)
    entered = _modules_entered(lambda: search.forward(trial, "forecast"))
    ends = [i + 1 for i, module in enumerate(entered) if module == "trial"]
    assert len(ends) == len(search.rounds) == 2
    for first, end in zip([0, *ends], ends, strict=False):
        of_round = entered[first:end]
        assert len(of_round) - 1 <= 6, of_round
        assert len(of_round) - len(set(of_round)) <= 2, of_round
