"""The test rigs: plain ones are exactly linear, each hidden effect does what its name says, and nothing leaks."""

from functools import cache

import numpy as np
import pytest
from scipy.signal import cont2discrete

from simgap.data.simulated.rigs import CATALOGUE, OUTSIDE, RIGS, hide, physical, suitable
from simgap.data.simulated.rigs.drive_kernels import Drive, arriving

EVERY = [(rig, effect) for rig in RIGS for effect in (*suitable(rig), *suitable(rig, outside=True))]


def experiments(data):
    return (*data.training.train, *data.training.valid, *data.test)


def rows(data):
    return np.concatenate([experiment.y for experiment in experiments(data)])  # [16 T, ny]


@cache
def clean(rig, effect="", strength=1.0, substeps=20):
    return rows(hide(rig, {effect: strength} if effect else {}, noise=0.0, substeps=substeps))


def change(rig, effect, strength=1.0):
    """Of the output that changes most, in standard deviations of the plain rig's."""
    plain = clean(rig)
    return np.max(np.sqrt(np.mean((clean(rig, effect, strength) - plain) ** 2, axis=0)) / plain.std(axis=0))


def forced(rig, effect, **more):
    """The readings of the first training experiment, [T, ny], without noise."""
    return hide(rig, {effect: 1.0} if effect else {}, noise=0.0, **more).training.train[0].y


@pytest.mark.parametrize(("rig", "effect"), EVERY)
def test_every_effect_shows_when_it_is_strong_and_less_when_it_is_weak(rig, effect):
    assert change(rig, effect) >= 0.1
    if effect != "absolute_sensor":  # it is there or it is not
        assert change(rig, effect, 0.25) < change(rig, effect, 0.5) < change(rig, effect)
        assert np.array_equal(clean(rig, effect, 0.0), clean(rig))


@pytest.mark.parametrize(("rig", "effect"), EVERY)
def test_half_the_step_of_the_integration_gives_the_same_output(rig, effect):
    error = clean(rig, effect, substeps=40) - clean(rig, effect)
    assert np.all(np.sqrt(np.mean(error**2, axis=0)) < 0.001 * clean(rig).std(axis=0))


@pytest.mark.parametrize("rig", RIGS)
def test_a_plain_rig_is_the_exact_discretisation_of_its_linear_equation(rig):
    r = RIGS[rig]
    if r.outflow:
        a = np.array([[-r.outflow, r.upper], [0.0, -r.upper]])
        b = np.array([[0.0], [r.gain]] if r.upper else [[r.gain], [0.0]])
    else:
        a, b = np.array([[0.0, 1.0], [-r.stiffness - r.loop * r.gain, -r.damping]]), np.array([[0.0], [r.gain]])
    a, b, *_ = cont2discrete((a, b, np.eye(2), np.zeros((2, 1))), r.dt)  # the input is held
    rows_of = {"position": [1.0, 0.0], "velocity": [0.0, 1.0], "level": [1.0, 0.0], "other": [1.0, 0.0]}
    c = np.array([rows_of[output.kind] for output in r.outputs])  # [ny, 2]
    for experiment in experiments(hide(rig, {}, noise=0.0)):
        # The start is not told, so it is found: the free response is linear in it.
        x, forced_y, free_y, free = np.zeros(2), [], [], np.eye(2)
        for u in experiment.u:
            forced_y.append(c @ x)
            free_y.append(c @ free)
            x, free = a @ x + b @ u, a @ free
        left = experiment.y - np.array(forced_y)  # [T, ny]
        basis = np.concatenate(free_y)  # [T ny, 2]
        start = np.linalg.lstsq(basis, left.ravel(), rcond=None)[0]
        assert left.ravel() == pytest.approx(basis @ start, abs=1e-6 * experiment.y.std())


@pytest.mark.parametrize(("rig", "effect"), EVERY)
def test_an_effect_leaves_the_inputs_and_the_name_as_they_were(rig, effect):
    plain, hidden = hide(rig, {}, seed=3), hide(rig, {effect: 1.0}, seed=3)
    assert plain.name == hidden.name == f"{rig}_3"
    for one, other in zip(experiments(plain), experiments(hidden), strict=True):
        assert one.name == other.name
        assert np.array_equal(one.u, other.u)


def test_an_effect_of_the_sensor_leaves_the_noise_as_it_was():
    noise = rows(hide("cart", {})) - clean("cart")
    drifting = rows(hide("cart", {"sensor_drift": 1.0})) - clean("cart", "sensor_drift")
    assert drifting == pytest.approx(noise, abs=1e-12)


def test_the_same_seed_gives_the_same_data_and_another_seed_other_data():
    effects = {"coulomb_friction": 0.5, "sensor_drift": 0.5}
    one = hide("stage", effects, seed=1)
    assert one.sha256 == hide("stage", effects, seed=1).sha256 != hide("stage", effects, seed=2).sha256
    assert len({experiment.u.tobytes() for experiment in experiments(one)}) == 16
    assert len({experiment.y[0, 0] for experiment in experiments(one)}) == 16


def test_the_data_have_the_shape_that_is_promised():
    for name, rig in RIGS.items():
        data = hide(name, {}, seed=5)
        assert [len(data.training.train), len(data.training.valid), len(data.test)] == [8, 4, 4]
        assert [experiment.name for experiment in experiments(data)] == [f"e{k:02d}" for k in range(16)]
        assert {len(experiment) for experiment in experiments(data)} == {300}
        assert (data.n_init, data.channels.outputs) == (20, rig.outputs)
        assert name[:4] != "tank" or min(experiment.u.min() for experiment in experiments(data)) == 0.0


@pytest.mark.parametrize("colour", [0.0, 0.7])
def test_the_noise_has_the_size_and_the_colour_that_are_set(colour):
    noise = rows(hide("slide", {}, noise=0.2, colour=colour)) - clean("slide")  # [16 T, 2]
    assert noise.std(axis=0) == pytest.approx(0.2 * clean("slide").std(axis=0), rel=0.06)
    assert np.sum(noise[1:] * noise[:-1], axis=0) / np.sum(noise**2, axis=0) == pytest.approx(colour, abs=0.04)


@pytest.mark.parametrize("effect", ["coulomb_friction", "stribeck_friction"])
def test_a_cart_with_dry_friction_stands_still_where_the_force_stays_below_the_limit(effect):
    limit = physical("cart", {effect: 1.0})[effect] * (RIGS["cart"].breakaway if effect[0] == "s" else 1.0)
    stuck = 0
    for experiment in hide("cart", {effect: 1.0}, noise=0.0).training.train:
        v, push = experiment.y[:, 0], RIGS["cart"].gain * np.abs(experiment.u[:, 0])
        still = (v[:-1] == 0.0) & (v[1:] == 0.0)
        stuck += np.sum(still)
        assert np.all(push[:-1][still] <= limit)
        assert np.all(v[1:][(v[:-1] == 0.0) & (push[:-1] <= limit)] == 0.0)
    assert stuck > 100


def test_friction_that_falls_with_speed_asks_for_more_force_to_start_than_to_go_on():
    rig = RIGS["cart"]
    high = physical("cart", {"stribeck_friction": 1.0})["stribeck_friction"]
    for experiment in hide("cart", {"stribeck_friction": 1.0}, noise=0.0).training.train:
        started = np.flatnonzero((experiment.y[:-1, 0] == 0.0) & (experiment.y[1:, 0] != 0.0))
        assert np.all(rig.gain * np.abs(experiment.u[started, 0]) >= rig.breakaway * high)
        going = experiment.y[1:, 0] * experiment.y[:-1, 0] > 0
        assert np.any(rig.gain * np.abs(experiment.u[:-1, 0])[going] < 1.5 * high)


@pytest.mark.parametrize("rig", ["cart", "supply"])
def test_what_cannot_brake_returns_to_zero_no_faster_than_it_coasts_and_rises_as_before(rig):
    most = physical(rig, {"limited_braking": 1.0})["limited_braking"]
    held, free = (clean(rig, *hidden).reshape(-1, 300) for hidden in (["limited_braking"], []))
    outwards = [np.diff(y, axis=1) * np.sign(y[:, :-1]) / RIGS[rig].dt for y in (held, free)]
    outwards = [rate[(y[:, :-1] * y[:, 1:]) > 0] for rate, y in zip(outwards, (held, free), strict=True)]
    assert outwards[0].min() >= -most * (1 + 1e-9) > 1.5 * outwards[1].min()
    assert np.sum(np.isclose(outwards[0], -most)) > 200
    assert outwards[0].max() > 1.5 * most


@pytest.mark.parametrize("rig", ["tank", "tanks"])
def test_a_tank_that_overflows_never_stands_above_its_rim(rig):
    for strength in (0.25, 1.0):
        rim = physical(rig, {"overflow": strength})["overflow"]
        level = clean(rig, "overflow", strength)
        assert level.max() == rim
        assert np.sum(level == rim) > 20
        # What was lost is lost: long after the rim the level is still below that of a tank without one. What the
        # upper of two tanks spills, however, is in the lower one sooner than what goes its proper way.
        assert rig == "tanks" or np.all(level <= clean(rig) + 1e-12)
        assert np.sum((level < clean(rig) - 0.1) & (level < rim)) > 20


def test_a_body_never_goes_beyond_its_stop_and_what_rests_there_leaves_it_inwards():
    end = physical("slide", {"hard_stop": 1.0})["hard_stop"]
    x, v = clean("slide", "hard_stop").T
    assert np.abs(x).max() == end
    assert np.all(v[x == end] <= 0) and np.all(v[x == -end] >= 0)
    assert np.sum(v[np.abs(x) == end] == 0) > 50


def test_a_sticking_valve_without_a_jump_is_backlash_and_one_with_a_jump_is_not():
    unlimited = dict.fromkeys(("limit", "rate", "inner_limit"), np.inf)
    drive = dict.fromkeys(Drive._fields, 0.0) | {"amplitude": 1.0} | unlimited
    u = np.random.default_rng(1).normal(size=200).cumsum()
    play = arriving(Drive(**drive | {"gap": 2.0}), u, 0.1, 4)
    assert arriving(Drive(**drive | {"stick": 2.0}), u, 0.1, 4) == pytest.approx(play)
    assert np.std(arriving(Drive(**drive | {"stick": 2.0, "slip": 1.0}), u, 0.1, 4) - play) > 0.1


def test_the_root_of_the_level_empties_a_tank_as_torricelli_says():
    rig = RIGS["tank"]
    h = forced("tank", "sqrt_outflow")[:, 0]
    u = hide("tank", {}).training.train[0].u[:, 0]
    rate = rig.gain * u - rig.outflow * np.sqrt(h * rig.middle[0])
    held = u[:-2] == u[1:-1]
    assert ((h[2:] - h[:-2]) / (2 * rig.dt))[held] == pytest.approx(rate[1:-1][held], abs=1e-3 * np.abs(rate).max())


@pytest.mark.parametrize(("rig", "effect", "column"), [("cart", "sensor_bias", 0), ("slide", "sensor_drift", 0)])
def test_a_bias_is_one_number_and_a_drift_one_line_in_each_experiment(rig, effect, column):
    added = (clean(rig, effect) - clean(rig))[:, column].reshape(16, 300)
    assert np.diff(added, n=1 + (effect == "sensor_drift")) == pytest.approx(0.0, abs=1e-12)
    assert len(set(added[:, -1])) == 16


def test_the_sensor_of_the_position_fails_and_that_of_the_velocity_does_not():
    for effect in ("sensor_drift", "sensor_saturation", "sensor_lag", "absolute_sensor", "quantisation", "outliers"):
        both = clean("slide", effect) != clean("slide")
        assert both[:, 0].any()
        assert not both[:, 1].any()


def test_limits_counts_and_outliers_are_those_of_the_table():
    size = {effect: physical("stage", {effect: 0.5})[effect] for effect in suitable("stage")}
    counts = rows(hide("stage", {"quantisation": 0.5})) / size["quantisation"]
    assert counts == pytest.approx(np.round(counts), abs=1e-9)
    assert np.abs(rows(hide("stage", {"sensor_saturation": 0.5}))).max() == size["sensor_saturation"]
    hit = np.abs(clean("stage", "outliers", 0.5) - clean("stage"))
    assert np.mean(hit > 0) == pytest.approx(size["outliers"], rel=0.4)
    assert hit[hit > 0] == pytest.approx(RIGS["stage"].outlier)


def test_a_delay_of_whole_samples_shifts_what_the_input_does():
    late = physical("slide", {"input_delay": 1.0})["input_delay"]
    samples = round(late / RIGS["slide"].dt)
    assert samples * RIGS["slide"].dt == pytest.approx(late)
    # Two rigs from the same start differ by the input alone, which stood at its first value before.
    data, plain = hide("slide", {"input_delay": 1.0}, noise=0.0), hide("slide", {}, noise=0.0)
    first = data.training.train[0]
    still = np.flatnonzero(np.diff(first.u[:, 0]))[0] + 1
    assert first.y[: still + 1] == pytest.approx(plain.training.train[0].y[: still + 1], abs=1e-12)
    assert np.any(first.y[still + 1] != plain.training.train[0].y[still + 1])


def test_a_missing_input_is_another_one_in_each_experiment():
    added = (clean("cart", "missing_input") - clean("cart"))[:, 0].reshape(16, 300)
    assert np.abs(np.corrcoef(added) - np.eye(16)).max() < 0.8


def test_two_effects_can_be_hidden_together():
    for rig in RIGS:
        names = suitable(rig)
        for one, other in zip(names, names[1:] + names[:1], strict=True):
            both = rows(hide(rig, {one: 1.0, other: 1.0}, noise=0.0))
            assert not np.array_equal(both, clean(rig, one))


def test_what_cannot_be_hidden_is_refused_with_what_can_be():
    with pytest.raises(ValueError, match="'overflow' cannot be hidden in 'cart'; what can be: dead_zone"):
        hide("cart", {"overflow": 1.0})
    with pytest.raises(ValueError, match="there is no rig 'boat'; known are cart, stage"):
        hide("boat", {})
    assert not set(CATALOGUE) & set(OUTSIDE)
