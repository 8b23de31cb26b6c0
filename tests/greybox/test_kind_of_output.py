"""What an output is where nobody says it: what the readings alone show, and which plant the records speak for."""

from dataclasses import replace

import numpy as np
import pytest

from simgap.data.simulated.rigs import hide
from simgap.greybox.identification import channels_of, identify
from simgap.greybox.kind_of_output import settle
from simgap.greybox.position_and_velocity import integral_share, plants_of, with_velocity
from simgap.records import Channel, Channels, Experiment, TrainingSet


def unsaid(data, *kinds):
    """Training data whose outputs are called y0, y1, ... and have no unit; a kind is written where one is given."""
    said = kinds or (None,) * len(data.channels.outputs)
    outputs = tuple(Channel(f"y{i}", kind=kind) if kind else Channel(f"y{i}") for i, kind in enumerate(said))
    return replace(data.training, channels=Channels((Channel("u"),), outputs))


def two_signals(y, dt=0.1):
    channels = Channels((Channel("u"),), (Channel("a"), Channel("b")))
    return TrainingSet((Experiment("e", np.zeros((len(y), 1)), y, dt),), (), 10, channels)


def settled(rig, effects, noise=0.05):
    training = unsaid(hide(rig, effects, noise, seed=5))
    return settle(training, training.channels, 0)


@pytest.mark.parametrize("effect", [None, "quantisation", "outliers", "sensor_drift", "curved_sensor", "hysteresis"])
def test_a_position_and_its_velocity_are_seen_by_the_readings_whatever_is_hidden(effect):
    training = unsaid(hide("slide", {effect: 1.0} if effect else {}, seed=5))
    assert [c.kind for c in with_velocity(training).outputs] == ["position", "velocity"]
    turned = tuple(replace(x, y=x.y[:, ::-1]) for x in training.train)
    assert [c.kind for c in with_velocity(replace(training, train=turned, valid=())).outputs] == [
        "velocity",
        "position",
    ]


def test_of_a_pair_that_is_half_known_the_other_half_is_seen():
    data = hide("slide", {}, seed=5)
    assert [c.kind for c in with_velocity(unsaid(data, "position", None)).outputs] == ["position", "velocity"]
    assert [c.kind for c in with_velocity(unsaid(data, None, "velocity")).outputs] == ["position", "velocity"]


def test_a_position_and_its_velocity_are_one_plant_even_without_the_sign():
    training = hide("slide", {"absolute_sensor": 1.0}, seed=5).training
    assert plants_of(training, training.channels) == [(0, 1)]


def test_the_position_of_one_body_and_the_velocity_of_another_are_two_plants():
    training, other = (hide("slide", {}, seed=seed).training for seed in (5, 6))
    train = tuple(
        replace(one, y=np.stack((one.y[:, 0], two.y[:, 1]), axis=1))
        for one, two in zip(training.train, other.train, strict=True)
    )
    training = replace(training, train=train, valid=())
    position, velocity = training.channels.outputs
    of_other = replace(training.channels, outputs=(position, replace(velocity, unit="rad/s")))
    assert plants_of(training, of_other) == [(0,), (1,)]


@pytest.mark.parametrize("unit", ["rad/s", "V"])
def test_a_position_and_its_velocity_are_one_plant_in_whatever_unit(unit):
    training = hide("slide", {}, seed=5).training
    position, velocity = training.channels.outputs
    other = replace(training.channels, outputs=(position, replace(velocity, unit=unit)))
    assert plants_of(training, other) == [(0, 1)]


def test_what_is_written_is_never_changed():
    training = unsaid(hide("slide", {}, seed=5), "other", "other")
    assert with_velocity(training) is training.channels
    assert channels_of(identify(unsaid(hide("cart", {}, seed=5), "other")), training).outputs[0].kind == "other"


def test_a_signal_behind_a_lag_of_another_is_no_position():
    rng = np.random.default_rng(0)
    fast, slow = np.repeat(rng.uniform(-1, 1, 40), 10), np.zeros(400)
    for k in range(399):
        slow[k + 1] = slow[k] + 0.1 * (fast[k] - 0.2 * slow[k])
    assert integral_share(two_signals(np.stack((slow, fast), axis=1)), 0, 1) == 0.0


def test_a_sine_is_not_the_velocity_of_its_own_derivative():
    t = 0.1 * np.arange(400)
    both = two_signals(np.stack((np.sin(t), np.cos(t)), axis=1))
    assert integral_share(both, 0, 1) > 0.99
    assert integral_share(both, 1, 0) == 0.0


@pytest.mark.parametrize(
    ("rig", "effect", "kind"),
    [
        ("cart", "coulomb_friction", "velocity"),
        pytest.param("stage", "coulomb_friction", "position", marks=pytest.mark.slow),
        pytest.param("tank", "sqrt_outflow", "level", marks=pytest.mark.slow),
    ],
)
def test_the_kind_is_the_one_whose_plant_explains_the_records_with_the_hidden_effect(rig, effect, kind):
    one = settled(rig, {effect: 1.0})
    assert one.kind == kind
    assert not one.rivals


def test_nothing_is_claimed_of_an_output_that_asks_for_no_effect():
    one = settled("cart", {})
    assert one.kind == "other"
    assert not one.rivals


@pytest.mark.parametrize("effect", ["actuator_lag", "constant_load"])
def test_what_only_the_kind_would_tell_is_a_rival_and_no_finding(effect):
    one = settled("cart", {effect: 0.5})
    assert effect in [rival.name for _, rival in one.rivals]
