"""The recovery study as an open benchmark: cases from a secret seed, the answers of any tool, and their rates."""

from simgap.recovery.answers import answer
from simgap.recovery.drawing import make_cases
from simgap.recovery.scoring import score

__all__ = ["answer", "make_cases", "score"]
