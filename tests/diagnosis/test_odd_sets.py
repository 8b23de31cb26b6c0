"""Whatever the numbers are, a diagnosis ends in an answer or in one sentence: no exception, no warning, valid JSON."""

import runpy
from pathlib import Path

import pytest

ODD = runpy.run_path(str(Path(__file__).with_name("odd_sets.py")))
QUICK = (6, 8, 23, 25, 36, 43, 65, 389)


@pytest.mark.parametrize("seed", QUICK)
def test_an_odd_set_ends_in_an_answer_or_a_sentence(seed):
    assert ODD["outcome"](seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", (1, 2, 4, 5, 7183, 7451, 7596, 7659, *range(5000, 5096)))
def test_a_hundred_odd_sets_end_in_an_answer_or_a_sentence(seed):
    assert ODD["outcome"](seed)
