"""The test split is read once, after the fit: it may withdraw a name, and it changes nothing else."""

import json
from dataclasses import replace

import numpy as np
import pytest

from simgap.data.simulated.rigs import hide
from simgap.diagnosis.diagnose import diagnose
from simgap.registry import MODELS


@pytest.fixture(scope="module")
def with_friction():
    return hide("cart", {"coulomb_friction": 1.0}, noise=0.05, seed=5)


@pytest.fixture(scope="module")
def named(with_friction):
    return diagnose(with_friction, views_too=False)


@pytest.fixture(scope="module")
def oiled(with_friction):
    """The cart has friction in training, and none when it is tested: measured where the plain model says."""
    rng = np.random.default_rng(1)
    plain = MODELS["greybox"](effects=())
    plain.fit(with_friction.training, 0)
    n, test = with_friction.n_init, []
    for x in with_friction.test:
        y = x.y.copy()
        y[n:] = plain.simulate(x.u[None], x.y[None, :n])[0]
        test.append(replace(x, y=y + 0.02 * np.std(y) * rng.standard_normal(y.shape)))
    return replace(with_friction, test=tuple(test))


@pytest.fixture(scope="module")
def suspected(oiled):
    return diagnose(oiled, views_too=False)


def test_a_name_that_the_test_data_confirm_stays(named):
    assert named.verdict == "named"
    assert [cause.effect for cause in named.causes] == ["coulomb_friction"]
    assert named.suspects == ()
    assert named.to_json()["suspects"] == []
    assert named.findings.gain.low > 0


def test_a_name_that_the_test_data_do_not_confirm_is_a_suspect(suspected):
    assert suspected.verdict == "suspected"
    assert suspected.causes == ()
    assert [cause.effect for cause in suspected.suspects] == ["coulomb_friction"]
    assert suspected.findings.gain.low <= 0
    assert "Nothing is named. The training data ask for Coulomb friction, but" in " ".join(str(suspected).split())


def test_gain_and_traces_are_those_of_the_model_with_the_suspects(suspected, oiled):
    n = oiled.n_init
    runs = [suspected.model.simulate(x.u[None], x.y[None, :n])[0] for x in oiled.test]
    rmse = np.sqrt(np.mean(np.concatenate([run - x.y[n:] for run, x in zip(runs, oiled.test, strict=True)]) ** 2))
    assert list(suspected.findings.gain.after.values()) == pytest.approx([rmse])
    for trace, run in zip(suspected.findings.traces, runs, strict=True):
        np.testing.assert_allclose(trace.after, run)


def test_the_test_split_chooses_nothing_and_fits_nothing(named, suspected, with_friction):
    auto = MODELS["greybox-auto"]()
    auto.fit(with_friction.training, 0)
    for model in (named.model, suspected.model):
        for plant, same in zip(model.plants, auto.plants, strict=True):
            np.testing.assert_array_equal(plant.estimate.theta, same.estimate.theta)
    cause, suspect = named.causes[0], suspected.suspects[0]
    assert (cause.evidence, cause.gain, cause.parameters) == (suspect.evidence, suspect.gain, suspect.parameters)


def test_the_json_lists_suspects_as_causes_with_the_experiment_that_would_decide(named, suspected):
    answer = json.loads(json.dumps(suspected.to_json(), allow_nan=False))
    assert answer["verdict"] == "suspected"
    assert answer["causes"] == []
    (suspect,) = answer["suspects"]
    assert set(suspect) - set(named.to_json()["causes"][0]) == {"deciding_experiment"}
    assert suspect["effect"] == "coulomb_friction"
    assert suspect["deciding_experiment"]
    assert answer["gain"]["low"] <= 0


def test_where_nothing_is_named_nothing_is_suspected():
    clean = diagnose(hide("cart", {}, noise=0.05, seed=6), views_too=False)
    assert clean.verdict == "nothing_found"
    assert clean.suspects == ()
