"""What a view of a simulation error shows, and the names of all views."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from simgap.records import Kind

# What a simulation error is plotted against. An effect lists under these names the views that show it.
ViewName = Literal[
    "offset",
    "time since the start",
    "drift within experiment",
    "experiment",
    "size by experiment",
    "kind of experiment",
    "size by kind of experiment",
    "frequency band",
    "input",
    "amplitude",
    "position",
    "level",
    "value",
    "velocity",
    "rate of change",
    "sign of velocity",
    "time since reversal",
]
# Views of outputs of certain kinds; every output has the others. A velocity also has the view "position" where a
# position is measured beside it.
VIEWS_OF_KINDS: dict[ViewName, tuple[Kind, ...]] = {
    "position": ("position",),
    "level": ("level",),
    "value": ("other",),
    "velocity": ("position", "velocity"),
    "rate of change": ("level", "other"),
    "sign of velocity": ("position", "velocity"),
    "time since reversal": ("position", "velocity"),
}


@dataclass(frozen=True)
class Wrong:
    """One view of what a simulation gets wrong: of the error y - y_hat of one output.

    `channel` is the input or the other output that the error is held against, in the views that have one.
    `share` is the part of the mean squared error that the mean errors of the view's bins (or its strongest band)
    explain beyond chance; `chance` is how often chance alone explains as much (p-value, for this view by itself).
    `text` says it in a sentence. For plots: `at` holds the bins' centres, in `unit`, and `error` the mean errors
    there (the RMS errors for bands and sizes), in the unit of the output. For "experiment" and its relatives `at`
    counts experiments (or their kinds) from 1, and the halves of experiment i are at i - 0.25 and i + 0.25. The offset
    is at 0; directions are -1 (back), 0 (rest) and 1 (forwards).
    """

    view: ViewName
    output: str
    share: float
    chance: float
    text: str
    at: tuple[float, ...]
    error: tuple[float, ...]
    unit: str
    channel: str = ""

    @property
    def label(self) -> str:
        """The view with its channel: "velocity", "input u"."""
        return f"{self.view} {self.channel}".rstrip()
