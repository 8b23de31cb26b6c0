"""The study of thresholds changes what it says it changes."""

import runpy
from pathlib import Path

import pytest

from simgap.greybox import linear_rival, trial

pytestmark = pytest.mark.slow  # they import every module of three rooms
STUDY = runpy.run_path(str(Path(__file__).with_name("thresholds.py")))


@pytest.mark.parametrize(("module", "name"), STUDY["THRESHOLDS"])
def test_a_threshold_moves_within_the_study_and_comes_back(module, name):
    home = STUDY["importlib"].import_module(module)
    usual = getattr(home, name)
    for factor in STUDY["FACTORS"]:
        with STUDY["threshold"](module, name, factor) as value:
            assert getattr(home, name) == value
            assert (value > usual) == (factor > 1)
        assert getattr(home, name) is usual


def test_a_threshold_moves_wherever_it_was_imported_to():
    assert linear_rival.CONSISTENT is trial.CONSISTENT
    with STUDY["threshold"]("simgap.greybox.trial", "CONSISTENT", 1.5):
        assert linear_rival.CONSISTENT == trial.CONSISTENT == pytest.approx(1.95)
