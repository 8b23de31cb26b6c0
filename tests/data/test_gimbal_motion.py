"""The kernel of the gimbal against other people's integrators and against motions known in closed form."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from simgap.data.simulated.gimbal.inputs import INPUTS
from simgap.data.simulated.gimbal.recordings import Gimbal, simulate_gimbal

QUIET = {"noise": (0.0, 0.0), "drift": (0.0, 0.0), "quantisation": (0.0, 0.0)}
SMOOTH = Gimbal.linear(
    noise=(0.0, 0.0),
    position_torque=0.05,
    position_phase=0.4,
    constant_load=0.03,
    quadratic_drag=0.02,
    quadratic_stiffness=0.002,
    cubic_stiffness=0.003,
    periodic_disturbance=0.05,
    gain_fade=0.3,
    actuator_lag=0.04,
    input_delay=0.05,
)
FRICTION = Gimbal.linear(noise=(0.0, 0.0), cable_stiffness=0.0, coulomb=0.15)


def simulate(parameters, u, substeps=10):
    return simulate_gimbal(parameters, u, np.random.default_rng(0), substeps)


def voltage(kind="uniform", samples=100, seed=0):
    return INPUTS[kind](samples, np.random.default_rng(seed))[:, None]


def rates(t, state, target, duration, p):
    """The equation of motion in rad, written anew from the meaning of the parameters."""
    phi, v, volts, z = state
    current = ((1 - p.gain_fade * t / duration) * volts - p.gear * p.torque_constant * v) / p.resistance
    torque = p.gear * p.torque_constant * current - p.viscous * v - p.quadratic_drag * abs(v) * v
    torque -= p.cable_stiffness * phi + p.quadratic_stiffness * phi**2 + p.cubic_stiffness * phi**3
    torque -= p.position_torque * np.sin(np.rad2deg(phi) / p.position_period * 2 * np.pi + p.position_phase)
    torque += p.periodic_disturbance * np.sin(2 * np.pi * p.periodic_frequency * t) - p.constant_load
    torque -= p.hysteresis * z
    dz = (v - (abs(v) * z + v * abs(z)) / 2) / np.deg2rad(p.hysteresis_width)
    return [v, torque / (p.yaw_inertia + p.motor_inertia * p.gear**2), (target - volts) / p.actuator_lag, dz]


def integrate_with_scipy(p, u, dt=0.1):
    """y [T, 2] with an adaptive integrator that is restarted wherever the delayed input jumps."""
    duration, y, state = dt * len(u), [np.zeros(2)], np.zeros(4)
    delayed = np.concatenate([[0.0], u[:, 0]])  # [T+1]
    for k in range(len(u) - 1):
        edges = [k * dt, k * dt + p.input_delay, (k + 1) * dt]
        for part, (start, end) in enumerate(pairwise(edges)):
            arguments = (delayed[k + part], duration, p)
            run = solve_ivp(rates, (start, end), state, "RK45", args=arguments, rtol=1e-9, atol=1e-10)
            state = run.y[:, -1]
        y.append(np.rad2deg(state[:2]))
    return np.array(y)


def test_smooth_motion_agrees_with_an_adaptive_integrator():
    u = voltage()
    assert simulate(SMOOTH, u) == pytest.approx(integrate_with_scipy(SMOOTH, u), abs=1e-4)


def test_hysteresis_agrees_with_an_adaptive_integrator():
    p, u = replace(SMOOTH, hysteresis=0.1), voltage("joystick")
    assert simulate(p, u) == pytest.approx(integrate_with_scipy(p, u), abs=0.02)


def test_the_linear_gimbal_follows_the_matrix_exponential():
    p, u = Gimbal.linear(noise=(0.0, 0.0), cable_stiffness=0.0), np.full((30, 1), 4.0)
    pole, speed = p.damping / p.inertia, p.torque_per_volt * 4.0 / p.damping
    t = 0.1 * np.arange(30)
    phi = speed * (t - (1 - np.exp(-pole * t)) / pole)
    v = speed * (1 - np.exp(-pole * t))
    assert simulate(p, u) == pytest.approx(np.rad2deg(np.stack([phi, v], axis=1)), abs=1e-6)


def test_a_push_ends_at_rest_where_dry_friction_says_and_a_small_voltage_moves_nothing():
    p = FRICTION
    small = 0.9 * p.coulomb / p.torque_per_volt  # V
    u = np.concatenate([np.full(5, 6.0), np.zeros(10), np.full(10, small), np.full(10, -small)])[:, None]
    pole, slow = p.damping / p.inertia, p.coulomb / p.damping  # 1/s, rad/s
    pushed = p.torque_per_volt * 6.0 / p.damping - slow  # rad/s
    v_top = pushed * (1 - np.exp(-pole * 0.5))
    phi_top = pushed * 0.5 - v_top / pole
    to_rest = np.log1p(v_top / slow) / pole  # s
    phi_rest = phi_top + (v_top + slow) * (1 - np.exp(-pole * to_rest)) / pole - slow * to_rest
    y = simulate(p, u)
    assert y[5] == pytest.approx(np.rad2deg([phi_top, v_top]), abs=1e-6)
    assert to_rest < 1.0
    assert y[15:, 0] == pytest.approx(np.rad2deg(phi_rest), abs=1e-6)
    assert np.all(y[15:, 1] == 0.0)


def test_a_resting_body_breaks_loose_only_above_coulomb_and_stribeck_friction_together():
    p = replace(FRICTION, stribeck=0.05)
    breakaway = (p.coulomb + p.stribeck) / p.torque_per_volt  # V
    assert np.all(simulate(p, np.full((20, 1), 0.999 * breakaway)) == 0.0)
    assert simulate(p, np.full((20, 1), 1.001 * breakaway))[-1, 1] > 0.0


def test_a_cable_that_pulls_more_than_friction_turns_the_body_back_and_less_leaves_it():
    u = np.concatenate([np.full(10, 8.0), np.zeros(400)])[:, None]
    weak, strong = (simulate(replace(FRICTION, cable_stiffness=k), u)[:, 0] for k in (0.02, 0.2))
    assert weak[-1] == weak[30]
    assert strong[-1] < strong.max() - 20
    # It creeps to where friction just holds the cable.
    assert np.deg2rad(strong[-1]) * 0.2 == pytest.approx(FRICTION.coulomb, rel=1e-3)


@pytest.mark.parametrize("kind", sorted(INPUTS))
def test_halving_the_step_moves_the_default_gimbal_by_less_than_a_millionth_of_a_degree(kind):
    u = voltage(kind, samples=400)
    assert simulate(Gimbal(**QUIET), u) == pytest.approx(simulate(Gimbal(**QUIET), u, 20), abs=1e-6)


def test_halving_the_step_moves_all_effects_together_by_less_than_a_hundredth_of_a_degree():
    p = replace(SMOOTH, coulomb=0.15, stribeck=0.05, hysteresis=0.1)
    u = voltage(samples=400)
    assert simulate(p, u) == pytest.approx(simulate(p, u, 20), abs=0.01)


def test_the_back_emf_and_the_gear_enter_the_damping_and_the_inertia():
    p = Gimbal(gear=2.0, torque_constant=0.5, resistance=4.0, viscous=0.1, yaw_inertia=0.03, motor_inertia=0.001)
    assert p.inertia == pytest.approx(0.034)
    assert p.torque_per_volt == pytest.approx(0.25)
    assert p.damping == pytest.approx(0.35)
