"""The machines in the field: drawn from the seed, changed by what is hidden in them, and physical."""

from functools import cache

import numpy as np
import pytest

from simgap.data.simulated.field import RIGS, hide, suitable

EVERY = [(rig, effect) for rig in RIGS for effect in (*suitable(rig), *suitable(rig, outside=True))]


def experiments(data):
    return (*data.training.train, *data.training.valid, *data.test)


@cache
def recorded(rig, effect="", strength=1.0, seed=2, substeps=20):
    """Inputs and outputs of all experiments without noise, [16 T, nu + 1]."""
    data = hide(rig, {effect: strength} if effect else {}, noise=0.0, seed=seed, substeps=substeps)
    return np.concatenate([np.concatenate((x.u, x.y), axis=1) for x in experiments(data)])


@pytest.mark.parametrize(("rig", "effect"), EVERY)
def test_every_effect_changes_the_record_and_one_of_no_strength_does_not(rig, effect):
    plain, hidden = recorded(rig), recorded(rig, effect)
    assert np.max(np.std(hidden - plain, axis=0) / np.std(plain, axis=0)) > 0.02
    assert np.array_equal(recorded(rig, effect, 0.0), plain)


@pytest.mark.parametrize("rig", RIGS)
def test_constants_inputs_and_noise_are_those_of_the_seed(rig):
    one, again, other = (hide(rig, {}, noise=0.05, seed=seed) for seed in (4, 4, 5))
    assert one.sha256 == again.sha256 != other.sha256
    assert one.training.train[0].dt != other.training.train[0].dt
    assert [len(one.training.train), len(one.training.valid), len(one.test)] == [8, 4, 4]


@pytest.mark.parametrize("rig", RIGS)
def test_half_the_step_of_the_integration_gives_the_same_record(rig):
    change = recorded(rig, substeps=40) - recorded(rig)
    assert np.all(np.std(change, axis=0) < 0.005 * np.std(recorded(rig), axis=0))


def test_in_a_closed_loop_the_controller_answers_the_noise_and_what_is_hidden():
    plain = recorded("speed_loop")
    assert not np.array_equal(recorded("speed_loop", "dead_zone")[:, 0], plain[:, 0])
    noisy = hide("speed_loop", {}, noise=0.05, seed=2)
    assert not np.array_equal(noisy.training.train[0].u[:, 0], plain[:300, 0])
    assert np.array_equal(recorded("axis_open", "dead_zone")[:, 0], recorded("axis_open")[:, 0])


def test_a_pendulum_swings_as_far_as_its_gravity_is_strong():
    angles = [np.quantile(np.abs(recorded("pendulum", "gravity", strength)[:, 1]), 0.95) for strength in (0.25, 0.5)]
    assert angles == pytest.approx([0.8, 1.2], rel=0.1)
    assert np.quantile(np.abs(recorded("pendulum")[:, 1]), 0.95) < 0.06


def test_what_does_not_suit_a_machine_is_refused():
    with pytest.raises(ValueError, match="'pendulum'; what can be: gravity"):
        hide("pendulum", {"backlash": 1.0})
