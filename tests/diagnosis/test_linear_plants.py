"""Random linear plants are simulated to within their noise, and nothing is named."""

import runpy
from pathlib import Path

import pytest

from simgap.diagnosis.diagnose import diagnose

STUDY = runpy.run_path(str(Path(__file__).with_name("linear_plants.py")))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["other", "velocity"])
@pytest.mark.parametrize("seed", [*range(8), 10, 51])
def test_of_a_linear_plant_nothing_is_named(seed, kind):
    found = diagnose(STUDY["data_set"](seed, kind)).findings
    assert not found.causes
