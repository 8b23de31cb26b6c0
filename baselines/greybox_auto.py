"""A grey box that finds its own effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from simgap.baselines.greybox import GreyBox
from simgap.greybox.evidence import Part
from simgap.greybox.model import Machine, groups
from simgap.greybox.selection import Search
from simgap.records import TrainingSet
from simgap.registry import MODELS


@MODELS.register("greybox-auto")
@dataclass
class GreyBoxAuto(GreyBox):
    """The grey box with those effects of the catalogue that training and validation data ask for.

    What `simgap diagnose` does, as a model: score test, refits, held-out likelihood, one effect after the other.
    """

    effects: Sequence[str] = field(default=(), init=False, repr=False)
    searches: list[Search] = field(default_factory=list, init=False, repr=False)

    def fit(self, data: TrainingSet, seed: int) -> None:
        """Search on excerpts of the training data, then fit what was found to all of it; nothing here is random."""
        plants = groups(data.channels)
        self.searches = [Search.of(data.train, data.valid, data.channels, outputs).run() for outputs in plants]
        self.machines = [
            Machine.fit(search.path[-1].estimate, search, data.train + data.valid) for search in self.searches
        ]

    def plain(self) -> GreyBox:
        """The plain linear model that gains are counted from."""
        model = GreyBox()
        model.machines = [
            Machine.fit(search.plain, search, machine.experiments)
            for search, machine in zip(self.searches, self.machines, strict=True)
        ]
        return model

    def parts(self) -> list[Part]:
        """What was found out about each plant."""
        return [Part(*pair) for pair in zip(self.searches, self.machines, strict=True)]
