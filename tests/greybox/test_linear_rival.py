"""No effect is named where a linear model of another order does as well; a delay is believed while it is nearly it."""

import numpy as np
import pytest
from scipy.signal import lfilter

from simgap.data.simulated import field, rigs
from simgap.diagnosis.diagnose import diagnose
from simgap.greybox.fitting import Estimate
from simgap.greybox.identification import identify
from simgap.greybox.linear_rival import moves_by_itself_as
from simgap.records import TrainingSet

from .parts import channels, experiments, model, term
from .plants import free_run, position, steps


@pytest.fixture(scope="module")
def joint():
    """A motor behind a flexible joint, which swings; nothing else is wrong with it."""
    return field.hide("joint_link", {}, 0.005, 0.8, 105015)


@pytest.mark.slow
def test_a_joint_that_swings_is_a_matter_of_order_and_no_delay(joint):
    (one,) = identify(joint.training)
    assert one.linear is not None
    assert one.linear.baseline.plant.order > one.selection.baseline.plant.order
    # The fitted model is the linear one.
    assert one.plant.estimate.plant.order == one.linear.baseline.plant.order
    assert one.plant.estimate.plant.terms == ()


def test_the_first_sentence_says_that_order_does_as_well_and_the_answer_shows_that_model(joint):
    answer = diagnose(joint, views_too=False)
    assert answer.verdict == "nothing_found"
    assert answer.causes == answer.suspects == ()
    said = " ".join(str(answer).split())
    assert "Nothing is named. A linear model of order 4 simulates held-out angle at least as well" in said
    assert "Best linear model order 4" in said
    told = answer.to_json()
    assert told["linear"]["order"] == 4
    n = joint.n_init
    runs = [answer.model.simulate(x.u[None], x.y[None, :n])[0] for x in joint.test]
    rmse = np.sqrt(np.mean(np.concatenate([run - x.y[n:] for run, x in zip(runs, joint.test, strict=True)]) ** 2))
    assert told["linear"]["rmse"]["angle"] == pytest.approx(rmse)
    assert rmse < 0.5 * told["baseline"]["rmse"]["angle"]


@pytest.mark.parametrize(
    ("rig", "effects"),
    [
        ("cart", {"coulomb_friction": 0.5}),
        ("cart", {"actuator_lag": 0.5}),
        pytest.param("slide", {"input_delay": 0.5}, marks=pytest.mark.slow),
    ],
)
def test_an_effect_that_is_there_is_not_beaten(rig, effects):
    data = rigs.hide(rig, effects, noise=0.05, seed=3)
    (one,) = identify(data.training)
    assert one.linear is None
    assert one.selection.trial.names == tuple(effects)


def test_where_effects_do_better_the_answer_shows_no_other_linear_model():
    answer = diagnose(rigs.hide("cart", {"coulomb_friction": 1.0}, noise=0.05, seed=3), views_too=False)
    assert answer.to_json()["linear"] is None


def two_lags_in_coloured_noise(rng, samples):
    """A record of two lags, read with coloured noise as large as the output."""
    u = steps(rng, (1, samples))
    y, _ = free_run(position(stiffness=4.0, damping=4.0, gain=4.0), u, 0.1)
    noise = lfilter([1.0], [1.0, -0.98], rng.standard_normal(y.shape), axis=1)
    return experiments(u, y + np.sqrt(1 - 0.98**2) * np.std(y) * noise, 0.1)


def test_a_delay_does_not_stand_for_an_order_that_held_out_noise_left_out():
    rng = np.random.default_rng(4)
    train, valid = (tuple(two_lags_in_coloured_noise(rng, samples)) for samples in (700, 250))
    (one,) = identify(TrainingSet(train, valid, 10, channels("other")))
    assert one.selection.baseline.plant.order == 1
    assert one.selection.trial.names == ("input_delay",)
    assert one.linear is not None
    assert one.linear.baseline.plant.order > 1
    assert one.plant.estimate.plant.terms == ()


@pytest.mark.parametrize(("poles", "swings"), [((), False), ((0.5,), False), ((0.0, (2 * np.pi) ** 2), True)])
def test_a_disturbance_is_held_by_undamped_poles_at_its_frequency_and_a_model_may_have_none(poles, swings):
    plant = model("position", 0.01, (1.0, 1.0), 1.0).plant.having([term("periodic_disturbance")])
    theta = np.zeros(plant.size)
    theta[plant.part_of(plant.terms[0])] = 1.0, 1.0, 0.0  # of 1 Hz
    linear = model("other", 0.01, poles, 1.0)
    assert moves_by_itself_as(_ended_at(*linear), _ended_at(plant, theta), duration=20.0) is swings


def _ended_at(plant, theta):
    """A fit that ended there, whatever its errors."""
    return Estimate(plant, theta, np.zeros((1, plant.n_local)), np.zeros((1, 2, plant.ny)), 0.0, True)
