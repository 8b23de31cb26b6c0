"""Each effect of the gimbal does what its name says, nothing when it is off, and disturbs no noise draw."""

from dataclasses import replace

import numpy as np
import pytest

from simgap.data.simulated.gimbal.inputs import INPUTS
from simgap.data.simulated.gimbal.recordings import Gimbal, simulate_gimbal

CLEAN = Gimbal.linear(noise=(0.0, 0.0))

# Field -> (a value that shows, the value that is off, whatever else the effect is described by).
MOTION = {
    "coulomb": (0.1, 0.0, {}),
    "position_torque": (0.05, 0.0, {"position_period": 90.0, "position_phase": 1.0}),
    "voltage_limit": (3.0, np.inf, {}),
    "dead_zone": (0.5, 0.0, {}),
    "asymmetric_gain": (0.1, 0.0, {}),
    "backlash": (1.0, 0.0, {}),
    "input_delay": (0.05, 0.0, {}),
    "actuator_lag": (0.05, 0.0, {}),
    "gain_fade": (0.3, 0.0, {}),
    "constant_load": (0.05, 0.0, {}),
    "stribeck": (0.05, 0.0, {"stribeck_velocity": 30.0}),
    "quadratic_drag": (0.02, 0.0, {}),
    "quadratic_stiffness": (0.005, 0.0, {}),
    "cubic_stiffness": (0.005, 0.0, {}),
    "periodic_disturbance": (0.05, 0.0, {"periodic_frequency": 0.7}),
    "hysteresis": (0.1, 0.0, {"hysteresis_width": 10.0}),
}
SENSOR = {
    "noise": ((1.0, 2.0), (0.0, 0.0), {"noise_colour": 0.5}),
    "drift": ((1.0, 0.3), (0.0, 0.0), {}),
    "bias": ((3.0, 2.0), (0.0, 0.0), {}),
    "sensor_lag": ((0.05, 0.1), (0.0, 0.0), {}),
    "sensor_limit": ((20.0, 40.0), (np.inf, np.inf), {}),
    "absolute_sensor": ((True, True), (False, False), {}),
    "quantisation": ((1.0, 2.0), (0.0, 0.0), {}),
    "outlier_rate": (0.05, 0.0, {"outlier_size": (10.0, 300.0)}),
}


def simulate(parameters, u=None, seed=5):
    u = INPUTS["uniform"](200, np.random.default_rng(0))[:, None] if u is None else u
    return simulate_gimbal(parameters, u, np.random.default_rng(seed))


@pytest.mark.parametrize("field", [*MOTION, *SENSOR])
def test_an_effect_changes_the_output_when_it_is_on_and_not_one_bit_when_it_is_off(field):
    on, off, details = (MOTION | SENSOR)[field]
    shown = simulate(replace(CLEAN, **details, **{field: on}))
    assert np.all(np.abs(shown - simulate(CLEAN)).max(axis=0) > 0.1)
    assert np.array_equal(simulate(replace(CLEAN, **details, **{field: off})), simulate(CLEAN))


@pytest.mark.parametrize("field", MOTION)
def test_an_effect_on_the_motion_leaves_every_draw_of_the_sensors_as_it_was(field):
    on, _, details = MOTION[field]
    chance = {"noise": (1.0, 1.0), "drift": (1.0, 0.3), "bias": (1.0, 1.0), "outlier_rate": 0.02}
    quiet = replace(CLEAN, **details, **{field: on})
    drawn = simulate(replace(quiet, **chance)) - simulate(quiet)
    assert drawn == pytest.approx(simulate(replace(CLEAN, **chance)) - simulate(CLEAN), abs=1e-9)


def test_noise_drift_bias_and_outliers_are_drawn_independently_of_each_other():
    fields = ("noise", "drift", "bias", "outlier_rate")
    alone = [simulate(replace(CLEAN, **{field: SENSOR[field][0]})) - simulate(CLEAN) for field in fields]
    together = simulate(replace(CLEAN, **{field: SENSOR[field][0] for field in fields})) - simulate(CLEAN)
    assert together == pytest.approx(sum(alone), abs=1e-9)


def test_a_dead_zone_swallows_small_voltages_and_shortens_the_others():
    assert np.all(simulate(replace(CLEAN, dead_zone=1.0), np.full((20, 1), 0.9)) == 0.0)
    shortened = simulate(replace(CLEAN, dead_zone=1.0), np.full((20, 1), -3.0))
    assert shortened == pytest.approx(simulate(CLEAN, np.full((20, 1), -2.0)))


def test_the_amplifier_gives_no_more_than_its_limit():
    assert np.array_equal(
        simulate(CLEAN, np.full((20, 1), 9.0)), simulate(CLEAN, np.full((20, 1), CLEAN.voltage_limit))
    )


def test_an_asymmetric_gain_favours_one_sign():
    p = replace(CLEAN, asymmetric_gain=0.2)
    up, down, plain = (simulate(q, np.full((20, 1), v)) for q, v in ((p, 2.0), (p, -2.0), (CLEAN, 2.0)))
    assert up == pytest.approx(1.2 * plain)
    assert down == pytest.approx(-0.8 * plain)


def test_backlash_holds_the_voltage_until_the_gap_is_crossed():
    u = np.array([0.4, 2.0, 1.2, -1.0])[:, None]
    followed = np.array([0.0, 1.5, 1.5, -0.5])[:, None]  # by hand, with a gap of 1 V
    tail = np.zeros((20, 1))
    assert simulate(replace(CLEAN, backlash=1.0), u) == pytest.approx(simulate(CLEAN, followed))
    assert simulate(replace(CLEAN, backlash=1.0), tail) == pytest.approx(simulate(CLEAN, tail))


def test_a_delay_of_two_samples_shifts_the_output_by_two_samples():
    late = simulate(replace(CLEAN, input_delay=0.2))
    assert late[2:] == pytest.approx(simulate(CLEAN)[:-2], abs=1e-12)
    assert np.all(late[:2] == 0.0)


def test_the_gain_fades_to_its_last_value_at_the_end_of_the_experiment():
    stiff = replace(CLEAN, cable_stiffness=1.0, gain_fade=0.5)
    u = np.full((2000, 1), 2.0)  # slow enough that the spring follows
    ends = simulate(stiff, u)[[300, -1], 0] / simulate(replace(stiff, gain_fade=0.0), u)[[300, -1], 0]
    assert ends == pytest.approx([1 - 0.5 * 0.15, 0.5], abs=0.01)


def test_a_constant_load_hangs_the_spring_off_its_centre():
    p = replace(CLEAN, constant_load=0.1, cable_stiffness=0.5)
    assert simulate(p, np.zeros((200, 1)))[-1, 0] == pytest.approx(-np.rad2deg(0.2), rel=1e-3)


def test_a_lagging_sensor_reads_a_ramp_late_by_its_lag():
    u = np.full((100, 1), 4.0)
    p = replace(CLEAN, cable_stiffness=0.0)
    true, late = simulate(p, u), simulate(replace(p, sensor_lag=(0.25, 0.25)), u)
    assert (true - late)[-1] == pytest.approx([0.25 * true[-1, 1], 0.0], abs=1e-6)


def test_a_drift_is_a_straight_line_of_its_own_in_each_channel_and_experiment():
    t = 0.1 * np.arange(200)
    slopes = []
    for seed in range(2):
        line = simulate(replace(CLEAN, drift=(1.0, 0.3)), seed=seed) - simulate(CLEAN, seed=seed)  # [T, 2]
        assert line == pytest.approx(line[-1] / t[-1] * t[:, None], abs=1e-9)
        slopes += list(line[-1])
    assert len(set(slopes)) == 4


@pytest.mark.parametrize("colour", [0.0, 0.6])
def test_the_noise_has_the_level_and_the_colour_that_are_set(colour):
    p = replace(CLEAN, noise=(0.5, 2.0), noise_colour=colour)
    noise = simulate(p, np.zeros((20_000, 1)))  # [T, 2]
    neighbours = np.sum(noise[1:] * noise[:-1], axis=0) / np.sum(noise**2, axis=0)
    assert noise.std(axis=0) == pytest.approx([0.5, 2.0], rel=0.04)
    assert neighbours == pytest.approx(colour, abs=0.03)


def test_the_limits_the_counts_and_the_sign_of_the_sensors_show_in_the_readings():
    assert np.all(np.abs(simulate(replace(CLEAN, sensor_limit=(20.0, 40.0)))) <= [20.0, 40.0])
    counts = simulate(replace(CLEAN, quantisation=(0.5, 2.0))) / [0.5, 2.0]
    assert np.array_equal(counts, np.round(counts))
    assert simulate(replace(CLEAN, absolute_sensor=(True, False))).min(axis=0)[0] >= 0.0


def test_outliers_hit_the_share_of_samples_that_is_set_by_the_size_that_is_set():
    u = np.zeros((4000, 1))
    jumps = simulate(replace(CLEAN, outlier_rate=0.05), u)  # [T, 2]
    assert np.mean(jumps != 0, axis=0) == pytest.approx(0.05, abs=0.015)
    assert set(np.abs(jumps[:, 0])) == {0.0, CLEAN.outlier_size[0]}
