"""A controller that is found on an exported model keeps on the machine what it promised there."""

import numpy as np
import pytest
from controller_study import study


@pytest.mark.slow
def test_a_pid_found_on_the_export_tracks_on_the_gimbal_and_better_than_one_found_on_the_plain_model():
    pytest.importorskip("gymnasium", reason="Gymnasium is not installed")
    done = study()
    here, there = done.on_export["with effects"], done.on_gimbal["with effects"]
    print(done)
    assert np.median(there / here) <= 1.2
    assert np.median(there) < np.median(done.on_gimbal["plain"])
