"""The general law of hysteresis: its equation, and that the oscillator of the Bouc-Wen benchmark gets its numbers."""

import numpy as np
import pytest

from simgap.greybox.effects.bouc_wen import BoucWen
from simgap.greybox.effects.hysteresis import Hysteresis

from .building import selected
from .parts import experiments

H = 0.02


def forces(law, p, v):
    """The mean force over each of the steps, from an unbent bristle."""
    memory = [0.0]
    return np.array([law.term(0.0, float(one), 0.0, H, [float(q) for q in p], 0, memory, 0) for one in v])


def velocities(seed, samples=600):
    rng = np.random.default_rng(seed)
    return 3 * np.sin(0.03 * np.arange(samples)) + rng.standard_normal(samples)


@pytest.mark.parametrize("gap", [0.0, 0.3])
def test_the_simple_law_is_one_of_its_laws(gap):
    few, v = np.array([2.0, 0.5, gap]), velocities(0)
    fine = Hysteresis().as_refined(few)
    assert forces(BoucWen, fine, v) == pytest.approx(forces(Hysteresis, few, v), abs=1e-12)


@pytest.mark.parametrize(("loss", "rise"), [(1.2, 0.7), (-0.4, 1.7), (0.0, 0.0), (2.0, 0.0)])
def test_it_follows_its_equation(loss, rise):
    v, stiffness, steps = velocities(1, 300), 3.0, 2000
    w, expected = 0.0, []
    for one in v:
        before = w
        for _ in range(steps):
            rate = one - 0.5 * (loss + rise) * abs(one) * w - 0.5 * (loss - rise) * one * abs(w)
            w += H / steps * rate
        expected.append(-stiffness * 0.5 * (before + w))
    found = forces(BoucWen, [stiffness, loss, rise, 0.0], v)
    assert found == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())


# Noel and Schoukens, Hysteretic benchmark with a dynamic nonlinearity, 2016: SI units, at 750 Hz.
MASS, DAMPING, STIFFNESS, ALPHA, BETA, GAMMA, DELTA, RATE = 2.0, 10.0, 5e4, 5e4, 1e3, 0.8, -1.1, 750.0


def slope(state, u):
    x, v, z = state
    bent = ALPHA * v - BETA * (GAMMA * np.abs(v) * z + DELTA * v * np.abs(z))
    return np.array([v, (u - DAMPING * v - STIFFNESS * x - z) / MASS, bent])


def oscillated(u, fine=10):
    """The displacement at the samples, by the method of Runge and Kutta."""
    state, x, h = np.zeros((3, len(u))), [], 1 / (RATE * fine)
    for now in u.T:
        x.append(state[0])
        for _ in range(fine):
            a = slope(state, now)
            b = slope(state + 0.5 * h * a, now)
            c = slope(state + 0.5 * h * b, now)
            state = state + h / 6 * (a + 2 * b + 2 * c + slope(state + h * c, now))
    return np.stack(x, axis=1)


@pytest.mark.slow
@pytest.mark.parametrize(("samples", "left_out"), [(1000, 0), (1600, 100)])
def test_the_oscillator_of_the_benchmark_is_recovered_from_rest_and_in_motion(samples, left_out):
    rng = np.random.default_rng(0)
    f = np.fft.rfftfreq(samples, 1 / RATE)
    tones = np.where((f >= 5) & (f <= 150), np.exp(2j * np.pi * rng.random((4, len(f)))), 0)
    u = np.fft.irfft(tones)
    u *= 50 / u.std()
    x = oscillated(u) + 8e-6 * rng.standard_normal(u.shape)
    records = experiments(u[:, left_out:], x[:, left_out:, None], 1 / RATE)
    trial = selected(records[:3], records[3:], "position")
    assert [type(term.effect) for term in trial.terms] == [BoucWen]
    stiffness, loss, rise, _ = trial.estimate.theta[trial.estimate.plant.part_of(trial.terms[0])]
    assert stiffness * MASS == pytest.approx(ALPHA, rel=0.01)
    assert loss == pytest.approx(BETA * (GAMMA + DELTA), rel=0.01)
    assert rise == pytest.approx(BETA * (GAMMA - DELTA), rel=0.01)
