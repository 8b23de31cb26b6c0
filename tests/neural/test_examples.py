"""What a network is shown: windows and pieces that stay within their experiment."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from simgap.neural.dynonet import DynoNet
from simgap.neural.gru import GRU
from simgap.neural.training.scaling import scalings
from simgap.neural.training.sequences import FREE, Sequences
from simgap.neural.training.windows import Windows
from simgap.records import Experiment, TrainingSet, UnusableInput


def numbered(name, first, length):
    """Every sample of u says which it is; y is u plus a half."""
    u = np.arange(first, first + length, dtype=float)[:, None]
    return Experiment(name, u, np.hstack((u + 0.5, -u)), 0.1)


def windows(lengths, window, resident=True, time=False):
    experiments, first = [], 0
    for i, length in enumerate(lengths):
        experiments.append(numbered(f"e{i}", first, length))
        first += 1000
    of_x, of_y = scalings(experiments, time)
    return Windows(experiments, of_x, of_y, window, time, resident), of_x, of_y


@pytest.mark.filterwarnings("ignore:.* experiments have fewer than")
@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(3, 40), min_size=1, max_size=4), st.integers(2, 12))
def test_a_window_ends_one_sample_before_its_target_in_the_same_experiment(lengths, window):
    if max(lengths) <= window:
        return
    made, of_x, of_y = windows(lengths, window)
    assert len(made) == sum(max(0, length - window) for length in lengths)
    x, y = made.batch(torch.arange(len(made)))
    u, target = of_x.outside(x.numpy())[:, :, 0], of_y.outside(y.numpy())[:, 0]
    np.testing.assert_allclose(np.diff(u, axis=1), 1, atol=0.01)
    np.testing.assert_allclose(target, u[:, -1] + 1.5, atol=0.01)


def test_windows_share_the_memory_of_the_data():
    made, *_ = windows([500, 300], 40)
    views, y = made.in_memory
    assert views.untyped_storage().nbytes() < 1.5 * y.untyped_storage().nbytes()


@pytest.mark.parametrize("time", [False, True])
def test_batches_made_while_training_are_those_held_in_memory(time):
    held, *_ = windows([60, 45, 50], 20, time=time)
    made, *_ = windows([60, 45, 50], 20, resident=False, time=time)
    chosen = torch.tensor([0, 39, 40, 64, 65, 94])
    for mine, theirs in zip(made.batch(chosen), held.batch(chosen), strict=True):
        torch.testing.assert_close(mine, theirs)


def test_experiments_on_disk_are_read_piece_by_piece(tmp_path):
    file = np.memmap(tmp_path / "u.bin", np.float64, "w+", shape=(400, 1))
    file[:, 0] = np.random.default_rng(0).standard_normal(400)
    x = Experiment("disk", file, np.asarray(file) * 2, 0.1)
    of_x, of_y = scalings([x], time=False)
    features, target = Windows([x], of_x, of_y, 10, False, resident=False).batch(torch.tensor([5]))
    np.testing.assert_allclose(of_x.outside(features.numpy())[0], file[5:15], atol=1e-6)
    np.testing.assert_allclose(of_y.outside(target.numpy())[0], 2 * file[15], atol=1e-6)


def test_too_short_experiments_are_refused_in_one_sentence():
    with pytest.raises(UnusableInput, match="longer than the window of 40 samples"):
        windows([30], 40)


def test_a_piece_shows_outputs_only_while_the_state_is_found():
    x = numbered("e", 1, 50)
    of_u, of_y = scalings([x], time=False)
    made = Sequences([x], of_u, of_y, n=6, free=10)
    features, target = made.batch(torch.arange(len(made)))
    assert features.shape[1:] == (16, 1 + 2 + 1)
    assert (features[:, 6:, 1:] == 0).all()
    assert (features[:, :6, 3] == 1).all()
    np.testing.assert_allclose(
        of_y.outside(target.numpy())[:, 0, 0], of_u.outside(features.numpy()[:, 6, :1])[:, 0] + 0.5, atol=1e-4
    )


@pytest.mark.parametrize(
    ("lengths", "piece", "short"),
    [
        ([500, 500, 900], 110, 0),  # all are long enough
        ([100] * 50 + [1000], 100, 0),  # the short ones hold most of the data
        ([20] * 3 + [1000], 110, 3),  # the long one does
        ([60, 80], 60, 0),
        ([8, 80], 80, 1),  # shorter than the start
    ],
)
def test_pieces_are_as_long_as_keeps_most_of_the_data_and_what_is_left_out_is_said(lengths, piece, short, recwarn):
    experiments = [numbered(f"e{i}", 1000 * i, length) for i, length in enumerate(lengths)]
    of_u, of_y = scalings(experiments, time=False)
    made = Sequences(experiments, of_u, of_y, n=10, free=100)
    assert made.length == piece
    said = [str(w.message) for w in recwarn]
    assert len(said) == bool(short)
    assert all(f"{short} of {len(lengths)} experiments have fewer than {piece} samples" in text for text in said)


def test_experiments_shorter_than_the_window_are_left_out_with_a_warning():
    with pytest.warns(UserWarning, match="1 of 2 experiments have fewer than 41 samples"):
        windows([40, 60], 40)


@pytest.mark.parametrize(("samples", "length"), [(2999, 10 + FREE), (3000, 10 + DynoNet.free)])
def test_long_pieces_are_for_records_ten_times_as_long(samples, length):
    u = np.random.default_rng(0).standard_normal((samples, 1))
    data = TrainingSet((Experiment("e", u, u, 0.1),), (), n_init=10)
    assert DynoNet().prepare(data, 0)[0].length == length
    assert GRU().prepare(data, 0)[0].length == 10 + FREE
