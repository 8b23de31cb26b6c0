"""Answers about measured machines are what they were, tracebacks included; the records are the user's own."""

import json
import runpy
from pathlib import Path

import pytest

GOLDEN = runpy.run_path(str(Path(__file__).with_name("golden.py")))


SLOW = (
    "arm_pendulum",
    "buck_converter",
    "damper_36lb",
    "dart_car",
    "loop_FIC20102",
    "loop_FIC40102C",
    "loop_LIC30501",
    "servo_xl330",
    "two_heaters",
)  # more than ten seconds each


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in GOLDEN["MEASURED"]]
)
def test_the_answer_about_a_measured_machine_is_what_it_was(name):
    if not GOLDEN["folder_of"](name).is_dir():
        pytest.skip(f"{name} is not at hand: set SIMGAP_DATA to the folder of measured data")
    kept = json.loads((GOLDEN["KEPT"] / f"{name}.json").read_text(encoding="utf-8"))
    assert not GOLDEN["differences"](kept, GOLDEN["without_words"](GOLDEN["answer"](name)))
