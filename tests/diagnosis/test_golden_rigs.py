"""Answers about simulated rigs are what they were: verdicts and names exactly, numbers to 1e-6."""

import json
import runpy
from pathlib import Path

import pytest

GOLDEN = runpy.run_path(str(Path(__file__).with_name("golden.py")))
# More than five seconds each.
SLOW = (
    "cart-stribeck", "slide-delay", "slide-hysteresis", "slide-outside", "slide-outside-force", "slide-pair",
    "stage-absolute", "stage-backlash", "stage-cubic", "stage-torque", "tank-sqrt", "tanks-drift", "tanks-overflow",
)  # fmt: skip


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in GOLDEN["RIGS"]]
)
def test_the_answer_about_a_rig_is_what_it_was(name):
    kept = json.loads((GOLDEN["KEPT"] / f"{name}.json").read_text(encoding="utf-8"))
    assert not GOLDEN["differences"](kept, GOLDEN["without_words"](GOLDEN["answer"](name)))
