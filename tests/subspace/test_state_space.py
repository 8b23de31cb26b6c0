"""Coordinates in which every two poles have a block of their own."""

import numpy as np
import pytest

from simgap.subspace.kernels import pushed
from simgap.subspace.state_space import blocks, in_blocks

POLES = {
    "two pairs and a real one": [[0.9, 0.3], [0.5, 0.6], 0.7],
    "three real ones": [0.2, 0.5, 0.9],
    "one that stands twice": [0.8, 0.8 + 1e-9, 0.3],
}


def matrices(poles, seed=0):
    """A with these poles (pairs as real and imaginary part) and a C, in coordinates that mix all states."""
    parts = [np.array([[p[0], p[1]], [-p[1], p[0]]]) if isinstance(p, list) else np.array([[p]]) for p in poles]
    n = sum(map(len, parts))
    a, place = np.zeros((n, n)), 0
    for part in parts:
        a[place : place + len(part), place : place + len(part)] = part
        place += len(part)
    mix = np.random.default_rng(seed).normal(size=(n, n))
    return mix @ a @ np.linalg.inv(mix), np.random.default_rng(seed + 1).normal(size=(2, n))


@pytest.mark.parametrize("poles", POLES.values(), ids=POLES)
def test_the_poles_stay_and_nothing_is_left_outside_of_the_blocks(poles):
    a, c = matrices(poles)
    moved, _ = in_blocks(a, c)
    np.testing.assert_allclose(
        np.sort_complex(np.linalg.eigvals(moved)), np.sort_complex(np.linalg.eigvals(a)), atol=1e-6
    )
    assert not moved[~blocks(len(a))].any()


def test_a_push_on_a_state_runs_through_its_block_to_the_outputs():
    rng = np.random.default_rng(0)
    a, c = matrices(POLES["two pairs and a real one"])
    a, c = in_blocks(a, c)
    x, u = rng.normal(size=(2, 30, 5))
    out = pushed(a, c, x, u[:, :1].copy())
    signals = {(i, j): x[:, i - i % 2 + j] for i in range(5) for j in range(2) if i - i % 2 + j < 5}
    signals |= {(i, 2): u[:, 0] for i in range(5)}
    for (i, j), signal in signals.items():
        state, expected = np.zeros(5), []
        for value in signal:
            expected.append(c @ state)
            state = a @ state
            state[i] += value
        np.testing.assert_allclose(out[i, j], expected, atol=1e-12)
    assert not out[4, 1].any()  # the last block has one state
