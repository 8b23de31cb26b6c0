"""What of long records a search looks at."""

import numpy as np

from .building import excerpts
from .parts import experiments


def counted(*lengths):
    """Experiments whose output counts the samples of all of them, so that a piece tells where it is from."""
    ends = np.cumsum(lengths)
    made = []
    for length, end in zip(lengths, ends, strict=True):
        y = np.arange(end - length, end, dtype=float)[None, :, None]
        made += experiments(np.zeros((1, length)), y, 0.1)
    return made


def test_records_that_are_no_longer_than_needed_are_taken_whole():
    made = counted(700, 800)
    assert excerpts(made, 1000) == made  # up to half as much again


def test_of_long_records_pieces_are_taken_that_hold_about_as_many_samples_as_asked_for():
    pieces = excerpts(counted(20_000, 10_000), 3000)
    assert all(len(piece) == 500 for piece in pieces)
    assert sum(map(len, pieces)) == 3000


def test_the_pieces_are_spread_evenly_from_the_first_sample_to_the_last_and_do_not_overlap():
    pieces = excerpts(counted(20_000, 10_000), 3000)
    begins = np.array([piece.y[0, 0] for piece in pieces])
    assert begins[0] == 0 and pieces[-1].y[-1, 0] == 29_999
    gaps = np.diff(begins)
    assert gaps.min() >= 500 and np.ptp(gaps) <= 500
    for piece in pieces:
        np.testing.assert_array_equal(np.diff(piece.y[:, 0]), 1.0)  # uninterrupted


def test_a_piece_never_reaches_over_two_experiments():
    for piece in excerpts(counted(1200, 900, 5000), 2000):
        first, last = piece.y[0, 0], piece.y[-1, 0]
        assert not any(first < end <= last for end in (1200, 2100))


def test_what_is_left_over_at_the_end_of_a_record_is_worth_it_from_half_a_piece_on():
    assert {len(piece) for piece in excerpts(counted(*[740] * 20), 5000)} == {500}
    assert {len(piece) for piece in excerpts(counted(*[760] * 20), 5000)} == {500, 260}
