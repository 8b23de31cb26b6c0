"""Which effects of a search are named: those it rests on, as far as the test experiments confirm them."""

from dataclasses import replace

import numpy as np
import pytest

from simgap.data.simulated.rigs import hide
from simgap.diagnosis import gains, promises
from simgap.diagnosis.diagnose import diagnose
from simgap.diagnosis.promises import promise, trusted
from simgap.greybox.evidence import Evidence
from simgap.greybox.identification import identify
from simgap.greybox.model import GreyBoxModel
from simgap.greybox.plant import MAX_TERMS
from simgap.records import Channel, Channels, Dataset, Experiment, TrainingSet


@pytest.fixture(scope="module")
def two_effects():
    return hide("cart", {"coulomb_friction": 1.0, "dead_zone": 1.0}, noise=0.05, seed=5)


@pytest.fixture(scope="module")
def identified(two_effects):
    return identify(two_effects.training)


@pytest.fixture
def promised(two_effects, identified, monkeypatch):
    """What is promised where the test data confirm models of up to so many effects."""

    def promised(confirmed, beats_mean=True, shares=None):
        def measure(*runs):
            gain, count = real(*runs), len(tried.pop())
            share = shares[count - 1] if shares else gain.share
            return replace(gain, share=share, low=0.1 if count <= confirmed else -0.1, beats_mean=beats_mean)

        real, tried, only = gains.measure, [], promises.only
        monkeypatch.setattr(promises, "only", lambda plant, terms: (tried.append(terms), only(plant, terms))[1])
        monkeypatch.setattr(promises.gains, "measure", measure)
        plain = GreyBoxModel([one.plain for one in identified])
        before = [gains.free_run(plain, x, two_effects.n_init) for x in two_effects.test]
        return promise([Evidence(one, two_effects.channels) for one in identified], two_effects, plain, before, False)

    return promised


def names(causes):
    return [cause.effect for cause in causes]


def test_what_the_test_data_confirm_together_is_named_together(promised):
    both = promised(confirmed=2)
    assert sorted(names(both.causes)) == ["coulomb_friction", "dead_zone"]
    assert both.suspects == ()


def test_the_effect_that_explains_least_is_withdrawn_first_and_the_other_fitted_without_it(promised, two_effects):
    both, one = promised(confirmed=2), promised(confirmed=1)
    assert names(one.causes) == names(both.causes)[:1]
    assert names(one.suspects) == names(both.causes)[1:]
    assert one.model.fitted["effects"] == [names(one.causes)]
    n = two_effects.n_init
    for x, after in zip(two_effects.test, one.after, strict=True):
        np.testing.assert_allclose(after, one.model.simulate(x.u[None], x.y[None, :n])[0])
    # Its parameters are those of the model that is named, not of the larger one.
    assert one.causes[0].parameters != both.causes[0].parameters


@pytest.mark.parametrize(("shares", "named"), [((0.6, 0.5), 1), ((0.6, 0.5995), 2), ((0.6, 0.61), 2)])
def test_an_effect_without_which_the_test_data_are_simulated_better_is_withdrawn(promised, shares, named):
    both = promised(confirmed=2)
    held = promised(confirmed=2, shares=shares)
    assert names(held.causes) == names(both.causes)[:named]
    assert names(held.suspects) == names(both.causes)[named:]


def test_where_nothing_is_confirmed_all_are_suspects_and_the_gain_is_theirs(promised):
    both, none = promised(confirmed=2), promised(confirmed=0)
    assert none.causes == ()
    assert names(none.suspects) == names(both.causes)
    assert none.gain.after == both.gain.after


def unequal_drive(rng, name):
    """A drive that integrates and pushes harder forwards than back: 10 s at 100 Hz."""
    u = np.repeat(rng.uniform(-1, 1, 50), 20)
    x, v, dt = np.zeros(1000), 0.0, 0.01
    for k, push in enumerate(u[:-1]):
        v += dt * (20 * push * (1.1 if push > 0 else 0.9) - 8 * v)
        x[k + 1] = x[k] + dt * v
    return Experiment(name, u[:, None], (x + 0.005 * rng.standard_normal(1000))[:, None], dt)


@pytest.mark.slow
def test_where_a_drive_integrates_pieces_of_the_test_confirm_what_a_whole_record_does_not(monkeypatch):
    real = gains.measure

    def measure(dataset, *runs):
        gain = real(dataset, *runs)
        return gain if len(dataset.test[0]) < 1000 else replace(gain, low=-0.1)

    monkeypatch.setattr(promises.gains, "measure", measure)
    rng = np.random.default_rng(0)
    *train, valid, one, other = [unequal_drive(rng, f"e{i}") for i in range(6)]
    channels = Channels((Channel("u", "V"),), (Channel("x", "m", "position"),))
    training = TrainingSet(tuple(train), (valid,), 10, channels)
    answer = diagnose(Dataset("drive", training, (one, other), 10, channels), views_too=False)
    assert names(answer.causes) == ["asymmetric_gain"]
    assert answer.findings.gain.low == -0.1
    assert answer.findings.gain.in_pieces.low > 0.5


def test_what_helps_a_simulation_that_is_worse_than_the_mean_is_only_suspected(promised):
    worse = promised(confirmed=2, beats_mean=False)
    assert worse.causes == ()
    assert len(worse.suspects) == 2
    assert worse.gain.low > 0


def test_a_search_that_ended_by_itself_is_trusted():
    assert trusted([]) == 0
    assert trusted([0.2] * (MAX_TERMS - 1)) == MAX_TERMS - 1


@pytest.mark.parametrize(
    ("shares", "count"),
    [
        ((0.9, 0.02, 0.02, 0.01, 0.01), 1),
        ((0.6, 0.3, 0.03, 0.03, 0.02), 2),
        ((0.5, 0.2, 0.2, 0.03, 0.02), 0),
        ((0.2, 0.2, 0.2, 0.2, 0.2), 0),
    ],
)
def test_a_search_that_was_stopped_is_trusted_for_the_few_effects_that_take_nearly_all(shares, count):
    assert len(shares) == MAX_TERMS
    assert trusted(shares) == count


@pytest.mark.slow
def test_a_name_that_is_withdrawn_is_told_beside_the_one_that_stays(two_effects, monkeypatch):
    low = iter([-0.1, 0.1])
    real = gains.measure
    monkeypatch.setattr(promises.gains, "measure", lambda *runs: replace(real(*runs), low=next(low)))
    answer = diagnose(two_effects, views_too=False)
    assert answer.verdict == "named"
    assert (len(answer.causes), len(answer.suspects)) == (1, 1)
    assert "Suspected besides, not shown: " in " ".join(str(answer).split())
