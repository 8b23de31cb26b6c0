"""Where the simulations of a grey box begin: the states at the first sample, the model being known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from .parts import (
    fitted,
    initial_states,
    model,
    own_numbers_of_each,
    problem_of,
    records,
    signless,
    simulated,
    usual_start,
    white_noise,
)
from .plants import free_run, position, steps, tanks, third_order, velocity

# Plant, and the model of it: kind and shape (poles section by section, or outflows), gain.
TRUTHS = {
    "velocity": (velocity(), ("velocity", [1.5], 2.0)),
    "position": (position(), ("position", [1.2, 4.0], 3.0)),
    "third order": (third_order(), ("other", [9.0, 18.0, 1.0], 20.0)),  # (s + 3)(s + 6) and s + 1
    "tanks": (tanks(), ("level", [0.5, 0.3], 0.4)),
}


def made_of(name, samples=40, dt=0.1, noise=0.0):
    """The model of a plant, records of the plant, and the true states at their first samples."""
    plant, (kind, shape, gain) = TRUTHS[name]
    rng = np.random.default_rng(0)
    u, start = steps(rng, (5, samples)), rng.uniform(0.5, 1.5, (5, len(plant.a)))
    y, _ = free_run(plant, u, dt, start)
    return model(kind, dt, shape, gain), records(u, y + noise * rng.standard_normal(y.shape), dt), start


@pytest.mark.parametrize("name", TRUTHS)
def test_the_true_states_are_found_in_data_without_noise(name):
    known, data, start = made_of(name)
    found = initial_states(known, data, white_noise(1.0))
    np.testing.assert_allclose(found, start, rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(simulated(known, data, found), data.y, atol=1e-5)


@pytest.mark.parametrize("name", TRUTHS)
def test_in_noise_the_states_are_those_of_least_squares(name):
    known, data, _ = made_of(name, noise=0.1)
    plant = TRUTHS[name][0]
    forced, _ = free_run(plant, data.u[:, :, 0], 0.1)
    still = np.zeros((1, data.u.shape[1]))
    free = np.stack([free_run(plant, still, 0.1, start)[0][0, :, 0] for start in np.eye(len(plant.a))], axis=1)
    expected = np.linalg.lstsq(free, (data.y - forced)[:, :, 0].T, rcond=None)[0].T
    error = np.sqrt(np.diag(np.linalg.inv(free.T @ free))) * 0.1
    # The search ends within 0.001 of the noise's variance, so within sqrt(0.001) = 0.03 standard errors.
    assert (np.abs(initial_states(known, data, white_noise(0.1)) - expected) < 0.05 * error).all()
    theta, own = fitted(known, data, white_noise(0.1), fixed=np.ones(len(known.theta), dtype=bool))
    assert (np.abs(own - expected) < 0.05 * error).all()
    np.testing.assert_array_equal(theta, known.theta)


@pytest.mark.parametrize("effects", [(), ("coulomb_friction", "position_torque"), ("absolute_sensor",)])
def test_states_found_side_by_side_are_those_that_are_found_one_by_one(effects):
    known = model("position", 0.01, [20.0, 9.0], 500.0, effects, two_outputs=True)
    rng = np.random.default_rng(0)
    u, true = 5 * rng.standard_normal((7, 30)), rng.standard_normal((7, 2)) * [40.0, 100.0]
    y = simulated(known, records(u, np.zeros((7, 30, 2)), 0.01), true) + 0.1 * rng.standard_normal((7, 30, 2))
    data, noise = records(u, y, 0.01), white_noise(0.1, 0.1)
    found = initial_states(known, data, noise)
    np.testing.assert_allclose(found, own_numbers_of_each(known, data, noise), rtol=1e-6, atol=1e-6)
    if not signless(known):
        np.testing.assert_allclose(found, true, atol=3.0)


@pytest.mark.parametrize("effects", [(), ("coulomb_friction", "cubic_stiffness")])
def test_a_record_that_makes_no_sense_leaves_the_others_as_they_are(effects):
    known = model("position", 0.01, [20.0, 9.0], 500.0, effects)
    rng = np.random.default_rng(1)
    u, true = 5 * rng.standard_normal((4, 30)), rng.standard_normal((4, 2)) * [40.0, 100.0]
    y = simulated(known, records(u, np.zeros((4, 30, 1)), 0.01), true) + 0.1 * rng.standard_normal((4, 30, 1))
    alone = initial_states(known, records(u, y, 0.01), white_noise(0.1))
    wild = rng.permutation(np.r_[1e6 * rng.standard_normal(29), 1e9])[None, :, None]
    beside = initial_states(known, records(u[[0, *range(4)]], np.concatenate((wild, y)), 0.01), white_noise(0.1))
    np.testing.assert_allclose(beside[1:], alone, rtol=1e-9, atol=1e-9)


def test_a_sensor_without_a_sign_starts_on_either_side_but_simulates_the_same_readings():
    known = model("velocity", 0.1, [1.5], 2.0, ("absolute_sensor",))
    rng = np.random.default_rng(2)
    u, start = steps(rng, (6, 60)), np.array([[1.0], [-1.0], [0.4], [-0.4], [2.0], [-2.0]])
    readings = np.abs(free_run(velocity(), u, 0.1, start)[0])
    found = initial_states(known, records(u, readings, 0.1), white_noise(0.01))
    np.testing.assert_allclose(found, start, atol=1e-3)  # the input tells the side


def behind_play(u, gap, begun):
    """The play operator, from where in its gap each record begins (-1 to 1)."""
    at, followed = u[:, 0] + 0.5 * gap * begun, np.empty_like(u)
    for k in range(u.shape[1]):
        at = np.clip(at, u[:, k] - 0.5 * gap, u[:, k] + 0.5 * gap)
        followed[:, k] = at
    return followed


def test_where_in_its_gap_a_drive_with_play_begins_is_found():
    known = model("velocity", 0.1, [1.5], 2.0, ("backlash",))
    gap, begun = known.theta[-1], np.array([-1.0, -0.6, 0.0, 0.3, 1.0])
    u = 1.5 * gap * steps(np.random.default_rng(3), (5, 80))
    u[:, :6] = 0.0  # nothing is crossed in the first samples
    start = np.linspace(-1.0, 1.0, 5)[:, None]
    y, _ = free_run(velocity(), behind_play(u, gap, begun), 0.1, start)
    data = records(u, y, 0.1)
    found = initial_states(known, data, white_noise(0.01 * float(np.std(y))))
    np.testing.assert_allclose(simulated(known, data, found), y, atol=0.02 * float(np.std(y)))
    np.testing.assert_allclose(found[:, 1], begun, atol=0.05)


def axis(rng, start):
    """Records of an axis without a spring from known states, noise of 0.1 added: model, records, true motion."""
    known = model("position", 0.1, [1.2, 0.0], 3.0)
    u = steps(rng, (len(start), 300))
    y, _ = free_run(position(stiffness=0.0), u, 0.1, start)
    return known, records(u, y + 0.1 * rng.standard_normal(y.shape), 0.1), y


def errors_of_free_runs(start):
    """RMSE of the free runs of six further records from ten noisy samples, without and with what training taught."""
    rng = np.random.default_rng(4)
    known, training, _ = axis(rng, start(rng, 12))
    usual = usual_start(known, training, white_noise(0.1), 10)
    _, others, y = axis(rng, start(rng, 6))
    beginning = others.beginning(10)
    both = [initial_states(known, beginning, white_noise(0.1))]
    if usual is not None:
        both.append(usual.beside(problem_of(known, beginning, white_noise(0.1)), known.theta, both[0]))
    return [float(np.sqrt(np.mean((simulated(known, others, local) - y) ** 2))) for local in both]


def test_where_all_records_start_at_rest_the_next_one_does():
    without, within = errors_of_free_runs(lambda rng, n: np.zeros((n, 2)))
    assert within < 0.3 * without


def test_where_records_start_anywhere_the_first_samples_decide():
    errors = errors_of_free_runs(lambda rng, n: 20 * rng.standard_normal((n, 2)))
    assert max(errors) < 1.1 * min(errors)


def swinging_with_coloured_noise(rng, runs, samples):
    """Records of a lightly damped position in motion, with coloured noise as large as the motion."""
    known = model("position", 0.1, [0.02, 0.2], 0.5)
    u = steps(rng, (runs, 200 + samples))
    y, _ = free_run(position(damping=0.02, stiffness=0.2, gain=0.5), u, 0.1)
    off = lfilter([1.0], [1.0, -0.95], rng.standard_normal(y.shape), axis=1)
    y += float(np.std(y)) / float(np.std(off)) * off
    return known, records(u[:, 200:], y[:, 200:], 0.1)


def test_a_single_record_tells_by_what_it_passes_through_where_the_next_one_may_begin():
    rng, weighing = np.random.default_rng(6), white_noise(1.0)
    known, training = swinging_with_coloured_noise(rng, 1, 2000)
    usual = usual_start(known, training, weighing, 10)
    _, others = swinging_with_coloured_noise(rng, 8, 500)
    beginning = others.beginning(10)
    without = initial_states(known, beginning, weighing)
    within = usual.beside(problem_of(known, beginning, weighing), known.theta, without)
    errors = [
        np.sqrt(np.mean((simulated(known, others, local) - others.y)[:, 10:] ** 2)) for local in (without, within)
    ]
    assert errors[1] < 0.8 * errors[0]


def test_a_record_too_short_for_several_runs_has_no_usual_start():
    known, data, _ = axis(np.random.default_rng(5), np.zeros((1, 2)))
    assert usual_start(known, data.beginning(30), white_noise(0.1), 10) is None


@pytest.mark.filterwarnings("error")
def test_a_record_of_one_reading_has_no_usual_start():
    known, data, _ = axis(np.random.default_rng(5), np.zeros((1, 2)))
    one = replace(data, mask=np.arange(data.mask.shape[1])[None] == 3)
    assert usual_start(known, one, white_noise(0.1), 10) is None


@pytest.mark.filterwarnings("error")
def test_where_every_reading_of_the_start_is_left_out_the_simulation_begins_at_the_first():
    known, data, _ = made_of("velocity", samples=1)
    unread = replace(data, mask=np.zeros_like(data.mask))
    np.testing.assert_array_equal(initial_states(known, unread, white_noise(1.0)), data.y[:, 0])
