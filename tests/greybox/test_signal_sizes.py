"""What is read off the signals before any effect is fitted: common lines of the errors, the grid of the readings."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from .parts import lattice, lines, tones

DT, SAMPLES = 0.05, 400
RESOLUTION = 1 / (DT * SAMPLES)  # Hz
T = DT * np.arange(SAMPLES)


def errors(*frequencies, amplitudes=(3.0, 2.0, 1.0), phases=(0.0,), noise=0.3):
    """Errors [E, T] with these sines, the phases being those of the experiments."""
    rng = np.random.default_rng(0)
    made = [sum(a * np.sin(2 * np.pi * f * T + phase) for a, f in zip(amplitudes, frequencies, strict=False))
            for phase in phases]  # fmt: skip
    return np.stack(made) + noise * rng.standard_normal((len(phases), SAMPLES))


def test_lines_that_all_experiments_share_are_found_strongest_first():
    found = lines(errors(1.37, 4.21, 7.03, phases=(0.0,) * 5), DT)
    np.testing.assert_allclose(found, [1.37, 4.21, 7.03], atol=0.25 * RESOLUTION)


def test_a_line_whose_phase_differs_between_experiments_cancels():
    shared = errors(4.21, amplitudes=(0.5,), phases=(0.0,) * 4)
    not_shared = errors(1.37, amplitudes=(3.0,), phases=2 * np.pi * np.arange(4) / 4)
    assert lines(shared + not_shared, DT)[0] == pytest.approx(4.21, abs=0.25 * RESOLUTION)


def test_a_tone_stands_out_from_what_is_around_it_whatever_its_phase():
    slow = 20 * np.cumsum(np.random.default_rng(1).standard_normal((4, SAMPLES)), axis=1)
    hum = errors(4.21, amplitudes=(30.0,), phases=2 * np.pi * np.arange(4) / 4)
    assert tones(slow + hum, DT)[0] == pytest.approx(4.21, abs=0.25 * RESOLUTION)


def test_pieces_of_one_run_tell_a_line_as_finely_as_the_whole_run():
    since = DT * SAMPLES * np.array([0.0, 3.0, 17.0, 31.0])
    found = lines(errors(1.3712, phases=2 * np.pi * 1.3712 * since), DT, since)
    assert found[0] == pytest.approx(1.3712, abs=0.25 * RESOLUTION / 32)


def test_one_line_is_not_found_twice():
    found = np.array(lines(errors(4.21, phases=(0.0, 0.0)), DT))
    assert np.abs(np.subtract.outer(found, found))[~np.eye(len(found), dtype=bool)].min() >= RESOLUTION


def test_what_does_not_repeat_within_a_record_is_no_line():
    assert all(f >= 0.7 * RESOLUTION for f in lines(errors(0.3 * RESOLUTION, amplitudes=(9.0,)), DT))


def test_where_there_is_no_error_there_is_no_line():
    assert lines(np.zeros((2, SAMPLES)), DT) == ()


@settings(max_examples=25, deadline=None, derandomize=True)
@given(step=st.floats(1e-6, 1e6))
def test_the_step_of_rounded_readings_is_found(step):
    y = np.random.default_rng(1).normal(scale=7.0, size=(3, 300))
    assert lattice(step * np.round(y)) == pytest.approx(step, rel=1e-6)


def test_readings_that_are_not_rounded_have_no_step():
    assert lattice(np.random.default_rng(2).normal(size=(3, 300))) == 0


def test_a_step_too_fine_to_matter_beside_the_signal_is_none():
    y = np.random.default_rng(3).normal(scale=1.0, size=(3, 20_000))
    assert lattice(1e-4 * np.round(y / 1e-4)) == 0
    assert lattice(2e-2 * np.round(y / 2e-2)) == pytest.approx(2e-2)


def test_a_signal_that_is_rounded_only_in_places_has_no_step():
    y = np.round(np.random.default_rng(4).normal(scale=7.0, size=(3, 300)))
    assert lattice(y) == 1
    y[0, :3] = 100.5, 200.5, 300.5
    assert lattice(y) == 0


def test_two_values_are_a_switch_and_no_grid():
    assert lattice(np.where(np.random.default_rng(5).random((2, 50)) > 0.5, 1.0, 0.0)) == 0
