"""After one designed record the truth is named and its twin is not; more seeds: python tests/twin_study.py."""

import pytest
from twin_study import cases
from twins import PAIRS


@pytest.mark.slow
@pytest.mark.parametrize("pair", PAIRS)
def test_one_designed_record_tells_twins_apart(pair):
    assert all(case.designed for case in cases(PAIRS[pair], 2))
