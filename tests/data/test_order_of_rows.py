"""Rows out of order and clocks that are too coarse: no option mends the steps, so the remedy is another."""

import numpy as np
import pandas as pd
import pytest

from simgap.data import load, read

N = 300
EVEN = np.arange(N) * 0.01
U = np.random.default_rng(0).choice([-1.0, 1.0], N)
SHUFFLED = np.random.default_rng(1).permutation(EVEN)
COLUMNS = (["u"], ["y"])


def frame(t) -> pd.DataFrame:
    return pd.DataFrame({"t": t, "u": U, "y": np.arange(N) * 1.0})


def all_rows(data) -> int:
    return sum(map(len, (*data.training.train, *data.training.valid, *data.test)))


@pytest.mark.parametrize("chosen", [{}, {"split_gaps": True}, {"resample": 0.01}, {"dt": 0.01}])
def test_rows_out_of_order_are_to_be_sorted_whatever_is_chosen(refused, chosen):
    sentence = refused(frame(SHUFFLED), *COLUMNS, **chosen)
    assert "sort the rows by this column" in sentence
    assert "--" not in sentence


def test_a_few_rows_out_of_order_are_to_be_sorted_where_that_makes_time_even(refused):
    t = EVEN.copy()
    t[[50, 51]] = t[[51, 50]]
    assert "sort the rows by this column" in refused(frame(t), *COLUMNS)


@pytest.mark.parametrize("chosen", [{}, {"split_gaps": True}, {"resample": 0.01}])
def test_time_that_runs_backwards_throughout_is_to_be_reversed(refused, chosen):
    sentence = refused(frame(EVEN[::-1]), *COLUMNS, **chosen)
    assert "from 2.99 s in the first row to 0 s in the last; reverse the order of the rows" in sentence


def test_time_that_begins_anew_now_and_then_is_still_cut(refused):
    t = EVEN % 1.0
    assert "--split-gaps" in refused(frame(t), *COLUMNS)
    assert all_rows(load(frame(t), *COLUMNS, split_gaps=True)) == N


DATES = pd.Series(pd.to_datetime("2024-05-01 12:00:00") + pd.to_timedelta(EVEN // 0.5 * 0.5, unit="s"))


@pytest.mark.parametrize("t", [EVEN // 0.1 * 0.1, np.floor(EVEN / 0.012) * 0.012, DATES, DATES.astype(str)])
@pytest.mark.parametrize("chosen", [{}, {"split_gaps": True}, {"resample": 0.01}])
def test_a_clock_that_many_rows_share_is_too_coarse_and_the_sampling_time_is_asked_for(refused, t, chosen):
    sentence = refused(frame(t), *COLUMNS, **chosen)
    assert "the clock is too coarse; give the true sampling time, about 0.0" in sentence
    assert "(--dt, or dt=.. in Python)" in sentence
    assert "delete" not in sentence


@pytest.mark.parametrize("t", [EVEN // 0.1 * 0.1, DATES, np.zeros(N)])
def test_a_coarse_clock_is_ignored_beside_a_sampling_time_and_that_is_said(t):
    reading = read(frame(t), *COLUMNS, dt=0.01)
    assert reading.said == ("column t ignored, a clock too coarse for steps of 0.01 s",)
    assert reading.dataset.training.dt == 0.01
    assert all_rows(reading.dataset) == N


def test_a_sampling_time_that_contradicts_a_coarse_clock_is_refused(refused):
    assert "correct one of them" in refused(frame(EVEN // 0.1 * 0.1), *COLUMNS, dt=0.02)
    t = EVEN // 0.1 * 0.1
    assert "split the file there" in refused(frame(np.append(t[:150], t[:150])), *COLUMNS, dt=0.01)


@pytest.mark.parametrize("chosen", [{}, {"split_gaps": True}])
def test_a_pause_that_a_coarse_clock_shows_is_not_bridged(refused, chosen):
    t = np.where(np.arange(N) < 155, EVEN, EVEN + 0.3) // 0.1 * 0.1
    sentence = refused(frame(t), *COLUMNS, dt=0.01, **chosen)
    assert "row 155" in sentence
    assert "rows are missing there: split the file" in sentence


def test_a_row_that_is_there_twice_is_still_to_be_deleted(refused):
    t = EVEN.copy()
    t[100:] -= 0.01
    assert "delete the repeated row" in refused(frame(t), *COLUMNS)
    assert "delete the repeated row" in refused(frame(t), *COLUMNS, dt=0.01)


def test_a_folder_with_a_coarse_clock_is_told_where_its_description_names_it(good, refused):
    for file in good.glob("*/*.csv"):
        header, *rows = file.read_text().splitlines()
        file.write_text("\n".join([header, *(f"{k // 5},{row.partition(',')[2]}" for k, row in enumerate(rows))]))
    assert "too coarse; leave time out of dataset.toml" in refused(good)
