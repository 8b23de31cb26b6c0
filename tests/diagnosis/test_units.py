"""The answer does not depend on the units of the data."""

from functools import cache

import pytest

from simgap.data.simulated.rigs import hide
from simgap.diagnosis.diagnose import diagnose
from simgap.records import Dataset, Experiment, TrainingSet

EFFECTS = {"cart": "coulomb_friction", "stage": "cubic_stiffness", "slide": "hysteresis", "tank": "sqrt_outflow"}
RIGS = [rig if rig == "cart" else pytest.param(rig, marks=pytest.mark.slow) for rig in EFFECTS]


def in_units(dataset, u=1.0, y=1.0, t=1.0):
    """The same data with these factors on inputs, outputs and time."""

    def scaled(experiments):
        return tuple(Experiment(x.name, u * x.u, y * x.y, t * x.dt) for x in experiments)

    training = dataset.training
    changed = TrainingSet(scaled(training.train), scaled(training.valid), dataset.n_init, dataset.channels)
    return Dataset(dataset.name, changed, scaled(dataset.test), dataset.n_init, dataset.channels)


@cache
def answer(rig, u=1.0, y=1.0, t=1.0):
    """What has no unit in the answer about a rig whose data have these factors: names, and numbers."""
    dataset = in_units(hide(rig, {EFFECTS[rig]: 1.0}, noise=0.05, seed=3), u, y, t)
    found = diagnose(dataset, views_too=False).to_json()
    plain, gain, causes = found["baseline"], found["gain"], found["causes"]
    names = (found["verdict"], plain["order"], [(c["effect"], c["confounded_with"]) for c in causes])
    shares = [gain[key] for key in ("share", "low", "high")] + [c[key] for c in causes for key in ("evidence", "gain")]
    shares += [found["left"], *plain["fit_percent"].values()]
    return names, shares, [c["log_likelihood_ratio"] for c in causes]


@pytest.mark.parametrize(
    "factors", [pytest.param({"u": 2.0**40}, marks=pytest.mark.slow), {"u": 2.0**-30, "y": 2.0**-36}], ids=str
)
@pytest.mark.parametrize("rig", RIGS)
def test_with_powers_of_two_on_the_signals_not_a_bit_of_the_answer_changes(rig, factors):
    names, shares, likelihoods = answer(rig, **factors)
    assert (names, shares) == answer(rig)[:2]
    assert likelihoods == pytest.approx(answer(rig)[2], rel=1e-9)  # differences of logarithms, which hold the unit


@pytest.mark.parametrize("rig", RIGS)
def test_with_another_unit_of_time_the_answer_is_the_same(rig):
    names, shares, likelihoods = answer(rig, t=2.0**20)
    assert names == answer(rig)[0]
    assert shares == pytest.approx(answer(rig)[1], rel=1e-4)
    assert likelihoods == pytest.approx(answer(rig)[2], rel=1e-4)
