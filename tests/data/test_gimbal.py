"""The gimbal's recordings: the paper's protocol, their spread, their seed, and what they must not reveal."""

import dataclasses
from collections import Counter

import numpy as np
import pytest

from simgap.data.simulated.gimbal.recordings import Gimbal, gimbal, gimbal_dataset
from simgap.registry import DATASETS


@pytest.fixture(scope="module")
def recordings():
    return gimbal()


def splits(dataset):
    return dataset.training.train, dataset.training.valid, dataset.test


def everything(dataset):
    return [experiment for split in splits(dataset) for experiment in split]


def kind(experiment):
    return experiment.name.split("_")[2]


def same(first, second, column):
    pairs = zip(everything(first), everything(second), strict=True)
    return [np.array_equal(getattr(a, column), getattr(b, column)) for a, b in pairs]


def test_the_registry_knows_the_gimbal_and_its_card_says_that_it_is_simulated():
    card = DATASETS["gimbal"].__doc__
    assert "simulated" in card.splitlines()[0]
    assert "not public" in card


def test_the_splits_have_the_counts_lengths_and_sampling_of_the_paper(recordings):
    assert [len(split) for split in splits(recordings)] == [151, 15, 15]
    for split, samples in zip(splits(recordings), (200, 400, 400), strict=True):
        assert {len(experiment) for experiment in split} == {samples}
    assert {experiment.dt for experiment in everything(recordings)} == {0.1}
    assert [(c.unit, c.kind) for c in recordings.channels.outputs] == [
        ("deg", "position"),
        ("deg/s", "velocity"),
    ]


def test_names_are_unique_and_every_split_holds_three_sessions_and_four_kinds_of_input(recordings):
    assert len({experiment.name for experiment in everything(recordings)}) == 181
    for split in splits(recordings):
        assert {experiment.name[:2] for experiment in split} == {"s1", "s2", "s3"}
        assert {kind(experiment) for experiment in split} == {"gaussian", "binary", "uniform", "joystick"}


def test_the_later_sessions_have_the_larger_share_of_the_joystick(recordings):
    made = Counter(experiment.name[:2] for experiment in everything(recordings))
    smooth = Counter(e.name[:2] for e in everything(recordings) if kind(e) == "joystick")
    assert smooth["s1"] / made["s1"] < 0.2
    assert min(smooth[session] / made[session] for session in ("s2", "s3")) > 0.45


def test_no_voltage_exceeds_8_volts(recordings):
    assert max(np.abs(experiment.u).max() for experiment in everything(recordings)) <= 8.0


def test_the_binary_input_has_two_levels_of_opposite_sign(recordings):
    for experiment in everything(recordings):
        if kind(experiment) == "binary":
            low, high = np.unique(experiment.u)
            assert low == -high


def test_the_joystick_pauses_for_half_a_second_or_more_in_every_experiment(recordings):
    for experiment in everything(recordings):
        if kind(experiment) == "joystick":
            idle = "".join("0" if volts == 0 else "1" for volts in experiment.u[:, 0])
            assert "00000" in idle.lstrip("0").rstrip("0")


def test_the_uniform_input_fills_the_range_evenly(recordings):
    volts = np.concatenate([e.u[:, 0] for e in everything(recordings) if kind(e) == "uniform"])
    counts = np.histogram(volts, bins=8, range=(-8, 8))[0]
    assert counts == pytest.approx(len(volts) / 8, rel=0.1)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_position_and_velocity_spread_like_the_authors_within_15_percent(seed):
    y = np.concatenate([experiment.y for experiment in everything(gimbal_dataset(seed=seed))])  # [n, 2]
    assert y.std(axis=0) == pytest.approx([90.0, 65.0], rel=0.15)


def test_every_experiment_starts_at_rest_at_zero(recordings):
    start = np.array([experiment.y[0] for experiment in everything(recordings)])  # [181, 2]
    assert np.all(np.abs(start) < 5 * np.array(Gimbal().noise))  # no more than noise


def test_the_position_is_read_in_counts_of_the_encoder(recordings):
    for experiment in everything(recordings):
        counts = experiment.y[:, 0] * 4096 / 360
        assert counts == pytest.approx(np.round(counts), abs=1e-9)


def test_a_position_drifts_further_than_its_noise_and_differently_in_every_experiment():
    still = gimbal_dataset(Gimbal(voltage_limit=0.0), n_train=40, n_valid=0, n_test=1)
    ends = np.array([experiment.y[-1] for experiment in still.training.train])  # [40, 2]
    assert ends.std(axis=0) == pytest.approx([20.0, 5.0], rel=0.35)
    assert len(np.unique(ends[:, 0])) > 30


def test_the_seed_alone_decides_every_bit():
    first, again = (gimbal_dataset(n_train=12, n_valid=4, n_test=4, seed=3) for _ in range(2))
    other = gimbal_dataset(n_train=12, n_valid=4, n_test=4, seed=4)
    assert first.sha256 == again.sha256 != other.sha256
    assert all(same(first, again, "y"))
    assert not any(same(first, other, "u"))
    assert not any(same(first, other, "y"))


def test_an_effect_leaves_the_inputs_as_they_were():
    plain, effect = (gimbal_dataset(p, n_train=12) for p in (Gimbal(), Gimbal(dead_zone=1.0)))
    assert all(same(plain, effect, "u"))
    assert not any(same(plain, effect, "y"))


def test_friction_differs_between_sessions_only_where_it_is_told_to():
    alike = Gimbal(session_friction=(1.0, 1.0, 1.0))
    plain, levelled = (gimbal_dataset(p, n_train=12) for p in (Gimbal(), alike))
    first_session = [experiment.name.startswith("s1") for experiment in everything(plain)]
    assert same(plain, levelled, "y") == first_session


def reachable(root):
    """Every object that attributes, items and array bases lead to from `root`."""
    found, todo = {}, [root]
    while todo:
        item = todo.pop()
        if id(item) in found:
            continue
        found[id(item)] = item
        if isinstance(item, dict):
            todo += [*item.keys(), *item.values()]
        elif isinstance(item, (tuple, list, set)):
            todo += item
        elif isinstance(item, np.ndarray) and item.base is not None:
            todo.append(item.base)
        todo += getattr(item, "__dict__", {}).values()
    return list(found.values())


def test_neither_the_truth_nor_a_test_array_is_reachable_from_the_training_set(recordings):
    objects = reachable(recordings.training)
    assert not any(isinstance(item, (Gimbal, np.random.Generator)) for item in objects)
    assert not any(callable(item) for item in objects)
    arrays = [item for item in objects if isinstance(item, np.ndarray)]
    kept = [array for experiment in recordings.test for array in (experiment.u, experiment.y)]
    assert len(arrays) >= 2 * 166
    assert not any(np.shares_memory(array, hidden) for array in arrays for hidden in kept)
    # An array may be a view, but of nothing that is larger than itself, such as the 200 Hz record.
    assert all(array.base is None or array.base.size == array.size for array in arrays)


def test_the_names_of_experiments_tell_session_number_and_input_and_nothing_of_the_truth():
    plain, effect = (gimbal_dataset(p, n_train=4) for p in (Gimbal(), Gimbal(hysteresis=0.2)))
    assert [e.name for e in everything(plain)] == [e.name for e in everything(effect)]
    assert plain.name == effect.name
    assert [e.name for e in plain.training.train[:2]] == ["s1_001_gaussian", "s1_002_binary"]


def test_every_constant_of_the_gimbal_is_a_number_or_a_tuple_of_numbers():
    for field in dataclasses.fields(Gimbal):
        assert np.all(np.isreal(np.atleast_1d(getattr(Gimbal(), field.name))))
