"""Time that is not even is refused with the option that helps; with that option it is put right, and that is said."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simgap.data import load, read
from simgap.data.formats.gaps import even_grid
from simgap.data.splits import split_pieces
from simgap.records import Experiment, UnusableInput


def frame(t) -> pd.DataFrame:
    """A ramp y = 3 t, which interpolation leaves as it is, and a slow sine for the input."""
    t = np.asarray(t, dtype=float)
    return pd.DataFrame({"t": t, "u": np.sin(t), "y": 3 * t})


def experiments(data) -> list:
    return [*data.training.train, *data.training.valid, *data.test]


EVEN = np.arange(200) * 0.1
GAP = np.concatenate([EVEN[:100], EVEN[105:]])
UNEVEN = np.cumsum(np.random.default_rng(0).uniform(0.05, 0.15, 300))


@pytest.mark.parametrize(
    ("t", "row", "said"),
    [
        (GAP, 100, "--split-gaps starts a new experiment there (split_gaps=True in Python), --resample 0.1"),
        (np.concatenate([EVEN, EVEN]), 200, "--split-gaps"),
        (UNEVEN, 1, "--resample 0.1"),
        (np.sort(np.append(EVEN, 5.0)), 51, "delete the repeated row"),
    ],
)
def test_uneven_time_is_refused_with_what_helps(refused, t, row, said):
    sentence = refused(frame(t), ["u"], ["y"])
    assert f"row {row}, column 't'" in sentence
    assert said in sentence


def test_splitting_is_not_offered_where_it_would_not_help(refused):
    assert "--split-gaps" not in refused(frame(UNEVEN), ["u"], ["y"])


def test_a_gap_starts_a_new_experiment():
    reading = read(frame(GAP), ["u"], ["y"], split_gaps=True)
    parts = experiments(reading.dataset)
    assert sum(map(len, parts)) == len(GAP)
    assert reading.dataset.training.dt == 0.1
    for part in parts:
        np.testing.assert_allclose(np.diff(part.y[:, 0]), 0.3)
    assert reading.said == ("sampling time 0.1 s from column t", "2 experiments of one file, cut at 1 gap in column t")


def test_the_pieces_of_a_log_know_when_they_began():
    for t in (EVEN, GAP + 7.0):
        parts = experiments(load(frame(t), ["u"], ["y"], split_gaps=True))
        assert len(parts) > 2
        for part in parts:
            assert part.since == pytest.approx(part.y[0, 0] / 3 - t[0])


def test_time_that_starts_again_starts_a_new_experiment():
    data = load(frame(np.concatenate([EVEN, EVEN, EVEN])), ["u"], ["y"], split_gaps=True)
    assert [part.y[0, 0] for part in data.training.train] == [0.0, 0.0]
    assert [len(part) for part in experiments(data)] == [200, 160, 40, 80, 120]
    assert [part.since for part in experiments(data)] == pytest.approx([0.0, 0.0, 16.0, 0.0, 8.0])


def test_short_pieces_are_left_out_and_that_is_said():
    t = np.concatenate([EVEN, 50 + EVEN[:3], 90 + EVEN])
    reading = read(frame(t), ["u"], ["y"], split_gaps=True)
    assert "1 of them of fewer than 10 rows left out, 3 rows in all" in str(reading)
    assert sum(map(len, experiments(reading.dataset))) == 400


def test_a_file_without_any_piece_of_ten_rows_is_refused(refused):
    t = np.arange(40) * 0.1 + 5.0 * (np.arange(40) // 5)
    assert "no piece has 10 rows" in refused(frame(t), ["u"], ["y"], split_gaps=True)


def test_split_gaps_changes_nothing_where_there_is_no_gap():
    reading = read(frame(EVEN), ["u"], ["y"], split_gaps=True)
    assert reading.dataset.sha256 == load(frame(EVEN), ["u"], ["y"]).sha256
    assert "cut at 0 gaps" in str(reading)


def test_split_gaps_alone_forgives_no_uneven_steps(refused):
    assert "--resample" in refused(frame(np.concatenate([EVEN, [20.03]])), ["u"], ["y"], split_gaps=True)


def test_uneven_time_is_interpolated_onto_the_grid_and_that_is_said():
    reading = read(frame(UNEVEN), ["u"], ["y"], resample=0.1)
    y = np.concatenate([part.y[:, 0] for part in experiments(reading.dataset)])
    np.testing.assert_allclose(np.diff(y), 0.3)
    assert reading.dataset.training.dt == 0.1
    assert f"300 rows resampled to {len(y)} samples every 0.1 s, {len(y) - 1} interpolated" in str(reading)


def test_samples_on_the_grid_are_kept_and_not_counted_as_interpolated():
    t = np.delete(EVEN, [50, 51])
    reading = read(frame(t), ["u"], ["y"], resample=0.1)
    assert "198 rows resampled to 200 samples every 0.1 s, 2 interpolated" in str(reading)


def test_what_a_coarser_grid_cannot_show_is_averaged_out_and_does_not_come_back_as_a_slow_swing():
    t = np.arange(60_000) * 1e-3
    log = frame(t).assign(y=np.sin(2 * np.pi * 49.9 * t))  # seen every 0.1 s it would swing at 0.1 Hz
    reading = read(log, ["u"], ["y"], resample=0.1)
    assert "60000 rows resampled to 600 samples every 0.1 s, each the mean over 0.1 s" in str(reading)
    assert max(np.abs(part.y).max() for part in experiments(reading.dataset)) < 0.03
    u = np.concatenate([part.u[:, 0] for part in experiments(reading.dataset)])
    np.testing.assert_allclose(u, np.sin(0.1 * np.arange(600)), atol=1e-3)


def test_the_mean_over_a_coarser_step_leaves_a_ramp_as_it_is_to_both_ends():
    reading = read(frame(UNEVEN), ["u"], ["y"], resample=0.5)
    y = np.concatenate([part.y[:, 0] for part in experiments(reading.dataset)])
    np.testing.assert_allclose(np.diff(y), 1.5)


def test_a_clock_of_whole_milliseconds_may_be_off_by_ten_percent_anywhere():
    t = np.arange(1000) * 0.01
    for late in (1, 20, 777):
        clock = t.copy()
        clock[late] += 1e-3
        assert load(frame(clock), ["u"], ["y"]).training.dt == 0.01
    assert abs(load(frame(np.round(np.arange(1000) * 0.0097, 3)), ["u"], ["y"]).training.dt - 0.0097) < 1e-6


def test_times_of_day_go_on_over_midnight():
    seconds = (86_390 + np.arange(30)) % 86_400
    log = frame(np.arange(30)).assign(t=[f"{s // 3600:02d}:{s // 60 % 60:02d}:{s % 60:02d}" for s in seconds])
    assert load(log, ["u"], ["y"]).training.dt == 1.0


def test_nothing_is_interpolated_across_a_wide_gap(refused):
    t = np.concatenate([UNEVEN, 20 + UNEVEN[-1] + UNEVEN])
    sentence = refused(frame(t), ["u"], ["y"], resample=0.1)
    assert "row 300" in sentence
    assert "--split-gaps" in sentence
    reading = read(frame(t), ["u"], ["y"], resample=0.1, split_gaps=True)
    assert "cut at 1 gap in" in str(reading)
    assert "resampled" in str(reading)
    for part in experiments(reading.dataset):
        np.testing.assert_allclose(np.diff(part.y[:, 0]), 0.3)


def test_nothing_is_resampled_where_time_stands_still_or_goes_back(refused):
    assert "row 51, column 't': time stands still" in refused(
        frame(np.sort(np.append(EVEN, 5.0))), ["u"], ["y"], resample=0.1
    )
    assert "goes back" in refused(frame(np.concatenate([EVEN, EVEN])), ["u"], ["y"], resample=0.1)


@pytest.mark.parametrize("step", [1e-9, 1e9])
def test_a_step_that_makes_no_sense_of_the_record_is_refused(refused, step):
    assert "step" in refused(frame(EVEN), ["u"], ["y"], resample=step) or step > 1


@pytest.mark.parametrize("step", [0.0, -1.0, float("nan"), float("inf")])
def test_a_step_that_is_none_is_refused(refused, step):
    assert "positive number of seconds" in refused(frame(EVEN), ["u"], ["y"], resample=step)


def test_resample_and_dt_contradict_each_other(refused):
    assert "leave out dt" in refused(frame(EVEN), ["u"], ["y"], dt=0.1, resample=0.1)


@pytest.mark.parametrize("chosen", [{"resample": 0.1}, {"split_gaps": True}])
def test_without_a_time_column_there_is_nothing_to_put_right(refused, chosen):
    bare = frame(EVEN).drop(columns="t")
    assert "without a time column" in refused(bare, ["u"], ["y"], **chosen)


@pytest.mark.parametrize("chosen", [{"resample": 0.1}, {"split_gaps": True}])
def test_a_folder_knows_its_time(good, refused, chosen):
    assert "knows its columns, sampling time" in refused(good, **chosen)


def test_a_fault_after_a_gap_is_named_by_its_row_in_the_file(refused):
    t = np.concatenate([EVEN, 50 + EVEN, [90.03]])
    t[300] += 0.03
    assert "row 300, column 't'" in refused(frame(t), ["u"], ["y"], split_gaps=True)


@settings(max_examples=100, deadline=None)
@given(steps=st.lists(st.floats(1e-3, 10), min_size=2, max_size=50), dt=st.floats(1e-3, 10))
def test_a_grid_is_even_and_stays_within_the_record(steps, dt):
    t = np.cumsum(np.array(steps))
    grid, new = even_grid(t, dt)
    assert grid[0] == t[0]
    assert grid[-1] <= t[-1] + 1e-5 * dt
    assert grid[-1] + dt > t[-1] - 1e-5 * dt
    assert 0 <= new < len(grid) or len(grid) == 1


@settings(max_examples=100, deadline=None)
@given(lengths=st.lists(st.integers(10, 500), min_size=2, max_size=12))
def test_pieces_are_split_in_time_without_losing_a_sample(lengths):
    marks = np.split(np.arange(sum(lengths), dtype=float)[:, None], np.cumsum(lengths)[:-1])
    splits = split_pieces([Experiment(str(k), part, part, 1.0) for k, part in enumerate(marks)])
    assert np.array_equal(np.concatenate([part.y for split in splits for part in split]), np.concatenate(marks))
    total = sum(lengths)
    for split, share in zip(splits, (0.6, 0.2, 0.2), strict=True):
        assert abs(sum(map(len, split)) - share * total) <= 0.1 * total + 2


@settings(max_examples=150, deadline=None)
@given(
    t=st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=60),
    resample=st.none() | st.floats(1e-6, 1e6),
    split_gaps=st.booleans(),
)
def test_whatever_the_times_are_the_record_is_loaded_or_refused_in_one_line(t, resample, split_gaps):
    try:
        load(frame(sorted(t) if len(t) % 2 else t), ["u"], ["y"], resample=resample, split_gaps=split_gaps)
    except UnusableInput as error:
        assert len(str(error).splitlines()) == 1
