"""One log of a motor, split in time: what changes over a run shows in all parts of it, as does what repeats in time."""

import numpy as np
import pandas as pd
import pytest

import simgap

DT, SUBSTEPS = 0.02, 10


def log(samples, fade=0.0, hum=0.0, hertz=1.37, reading=0.0, load=0.0, bias=0.0):
    """Record voltage and speed; the gain falls by a share `fade` over the log, `hum` in rad/s^2 shakes the motor.

    The reading is off by `bias` rad/s, and by `reading` more at the end; a brake takes `load` in rad/s^2 by then.
    """
    rng = np.random.default_rng(5)
    voltage = np.repeat(rng.uniform(-5.0, 5.0, samples // 40 + 1), 40)[:samples]
    t = DT / SUBSTEPS * np.arange(samples * SUBSTEPS)
    pushed = 8.0 * (1 - fade * t / (samples * DT)) * np.repeat(voltage, SUBSTEPS)
    pushed += hum * np.sin(2 * np.pi * hertz * t + 0.4) - load * t / t[-1]
    speed = np.zeros(samples * SUBSTEPS)
    for k in range(1, len(speed)):
        speed[k] = speed[k - 1] + DT / SUBSTEPS * (pushed[k - 1] - speed[k - 1] / 0.4)
    speed = speed[::SUBSTEPS]
    speed += 0.02 * np.std(speed) * rng.standard_normal(samples) + bias + np.linspace(0.0, reading, samples)
    table = pd.DataFrame({"t": DT * np.arange(samples), "voltage [V]": voltage, "speed [rad/s]": speed})
    return simgap.load(table, inputs=["voltage"], outputs=["speed"])


def named(table):
    """The one cause that is named."""
    found = simgap.diagnose(table, views_too=False)
    (cause,) = found.causes
    assert found.verdict == "named"
    return cause


@pytest.mark.parametrize("samples", [4000, pytest.param(25_000, marks=pytest.mark.slow)])
def test_a_motor_that_warms_up_in_the_course_of_one_log_is_named_with_its_rate(samples):
    cause = named(log(samples, fade=0.2))
    assert cause.effect == "gain_fade"
    assert cause.parameters[0].value == pytest.approx(0.2 / (samples * DT), rel=0.05)


@pytest.mark.parametrize("samples", [4000, pytest.param(25_000, marks=pytest.mark.slow)])
def test_hum_keeps_its_phase_through_one_log(samples):
    cause = named(log(samples, hum=8.0))
    assert cause.effect == "periodic_disturbance"
    amplitude, frequency, _ = (p.value for p in cause.parameters)
    assert abs(amplitude) == pytest.approx(8.0, rel=0.05)
    assert frequency == pytest.approx(1.37, abs=1e-3)


@pytest.mark.parametrize("samples", [4000, pytest.param(25_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("drift", [{"reading": 5.0}, {"load": 12.0}])
def test_a_drift_that_goes_on_evenly_is_named_and_whether_of_sensor_or_load_is_left_open(drift, samples):
    cause = named(log(samples, **drift))
    slope = cause.parameters[0].value * samples * DT
    assert {cause.effect, *(other.effect for other in cause.confounded_with)} == {"sensor_drift", "load_drift"}
    if cause.effect == "sensor_drift":
        assert slope == pytest.approx(drift.get("reading", -0.4 * drift.get("load", 0.0)), rel=0.05)
    else:
        assert slope == pytest.approx(drift.get("reading", 0.0) / 0.4 - drift.get("load", 0.0), rel=0.05)


def test_a_bias_of_the_reading_is_as_good_an_answer_as_a_constant_load():
    (cause,) = simgap.diagnose(log(4000, bias=3.0), views_too=False).causes
    assert {cause.effect, *(other.effect for other in cause.confounded_with)} == {"sensor_bias", "constant_load"}


def test_of_a_motor_that_does_not_change_nothing_is_said():
    assert simgap.diagnose(log(4000), views_too=False).causes == ()
