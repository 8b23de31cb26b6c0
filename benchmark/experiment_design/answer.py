"""The answer of `simgap next`: the rivals, the record, and what to expect of it."""

from __future__ import annotations

import csv
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from simgap.experiment_design.limits import Limits
from simgap.experiment_design.rivals import Question
from simgap.experiment_design.search import Design, Separated
from simgap.records import Channels
from simgap.wording import amount, number, percent

CERTAIN = 0.95  # the chance of a decision that is called one
ALIKE = 0.01  # D of rivals that simulate the same: no number of records tells them apart
ENOUGH = 30.0  # D with which one record decides nearly always


@dataclass(frozen=True, eq=False)
class NextRecord:
    """The rivals that the records leave, and the designed record; `wider` are designs with each limit twice as wide."""

    dataset: str
    channels: Channels
    limits: Limits
    questions: tuple[Question, ...]
    design: Design | None
    wider: Mapping[str, Design | None] = field(default_factory=dict)
    untold: str = ""
    doubt: str = ""

    @property
    def decides(self) -> bool:
        """Whether the designed record tells all rivals apart with a chance of 95 % or more."""
        return self.design is not None and self.design.chance >= CERTAIN

    @property
    def helps(self) -> bool:
        """Whether there is a record that sets any rivals apart."""
        return self.design is not None and not all(map(self._alike, self.design.separated))

    @property
    def _undecided(self) -> list[Separated]:
        return [one for one in (self.design.separated if self.design else ()) if one.chance < CERTAIN]

    @property
    def u(self) -> Float[np.ndarray, "T nu"] | None:
        """The inputs of the designed record."""
        return self.design.u if self.design else None

    @property
    def rivals(self) -> tuple[tuple[str, str], ...]:
        """The pairs that the records do not tell apart, the chosen model first."""
        return tuple((q.rivals[a].title, q.rivals[b].title) for q in self.questions for a, b in q.pairs)

    def write(self, path: str | Path) -> None:
        """Write time and inputs of the record as CSV, with the names of the data's columns."""
        assert self.design is not None, "there is a record to write"
        names = [channel.name for channel in self.channels.inputs]
        time = "t" if "t" not in names else "time"
        t = self.limits.dt * np.arange(len(self.design.u))
        with Path(path).open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerow([time, *names])
            np.savetxt(file, np.column_stack((t, self.design.u)), fmt="%.9g", delimiter=",")

    def to_json(self) -> dict[str, Any]:
        """Return the same as JSON."""
        limits, inputs, outputs = self.limits, self.channels.inputs, self.channels.outputs
        return {
            "schema": 1,
            "dataset": self.dataset,
            "doubt": self.doubt,
            "pairs": [
                {"rivals": [q.rivals[a].title, q.rivals[b].title], "behind": q.rivals[b].behind, "interval": q.interval}
                for q in self.questions
                for a, b in q.pairs
            ],
            "decides": self.decides,
            "separations": [
                {"rivals": [one.first, one.second], "d": list(one.d), "chance": one.chance,
                 "difference": list(one.difference)}
                for one in (self.design.separated if self.design else ())
            ],
            "limits": {
                "input_range": {c.name: [float(limits.low[i]), float(limits.high[i])] for i, c in enumerate(inputs)},
                "rate": {c.name: float(limits.rate[i]) for i, c in enumerate(inputs)},
                "seconds": limits.seconds,
                "travel": {
                    c.name: [float(limits.travel_low[j]), float(limits.travel_high[j])] for j, c in enumerate(outputs)
                },
            },
            "wider": {name: design.chance if design else 0.0 for name, design in self.wider.items()},
            "untold": self.untold,
        }  # fmt: skip

    def __str__(self) -> str:
        paragraphs = ["\n".join(textwrap.wrap(f"{self.dataset}: {self._headline()}", 100))]
        paragraphs += [
            "\n".join([title, *(line for item in items for line in textwrap.wrap(
                item, 98, initial_indent="  ", subsequent_indent="    "))])
            for title, items in (
                ("What is left open", list(self._listed())),
                ("The record", list(self._record())),
                ("With wider limits", list(self._wider())),
                ("What no record can tell", [self.untold] if self.untold else []),
            )
            if items
        ]  # fmt: skip
        return "\n\n".join(paragraphs) + "\n"

    __repr__ = __str__

    def _headline(self) -> str:
        if self.doubt or not self.rivals:
            return self.doubt or "The records leave no rival of the chosen model, so that no record is designed."
        if self._only_intervals():
            return f"The records leave no rival of the chosen model. Least certain is the {self._number_left()}."
        pairs = "; nor ".join(f"{a} from {b}" for a, b in self.rivals)
        return f"The records do not tell {pairs}. {self._hope()}"

    def _hope(self) -> str:
        """Say what a record can do about it."""
        if self.design is None:
            return "Every signal that was tried leaves the travel: allow more of it, or a shorter record."
        left = [one for one in self.design.separated if not self._alike(one)]
        if not left:
            return "No record can: they simulate the same under every input that was tried."
        chance = _chance(min(one.chance for one in left))
        same = "; ".join(f"{one.first} and {one.second}" for one in self.design.separated if self._alike(one))
        but = f" No record can tell {same}: they simulate the same under every input that was tried." if same else ""
        if all(one.chance >= CERTAIN for one in left):
            return f"The record below would, with a chance of {chance}.{but}"
        return f"No record within these limits is sure to; the best one would with a chance of {chance}.{but}"

    def _alike(self, one: Separated) -> bool:
        """Tell whether two rivals simulate the same, also within wider limits."""
        return is_alike(one, [design for design in (self.design, *self.wider.values()) if design])

    def _only_intervals(self) -> bool:
        return all(question.interval for question in self.questions if question.pairs)

    def _number_left(self) -> str:
        names = (q.interval for q in self.questions if q.interval)
        return " and the ".join(names)

    def _listed(self) -> Iterator[str]:
        for question in self.questions:
            for a, b in question.pairs:
                first, second = question.rivals[a], question.rivals[b]
                if first.held.any():
                    yield f"{first.title}; {second.title}: as far as the records and the bounds leave it open"
                else:
                    yield f"{first.title}; {second.title}: {number(second.behind, 2)} behind in log-likelihood"

    def _record(self) -> Iterator[str]:
        if self.design is None or not self.helps:
            return
        limits = self.limits
        for i, shape in zip(limits.moved, self.design.shapes, strict=True):
            channel, u = self.channels.inputs[i], self.design.u[:, i]
            unit = f" {channel.unit}".rstrip()
            low, high = number(float(u.min())), number(float(u.max()))
            yield (
                f"{channel.name}: {shape.kind}, {low} to {high}{unit}, periods from {number(shape.period * limits.dt)} "
                f"s, {number(limits.dt * len(u))} s long"
            )
        for j, channel in enumerate(self.channels.outputs):
            low, high = (amount(float(value), channel.unit) for value in self.design.reach[:, j])
            allowed = f"{number(float(limits.travel_low[j]))} to {number(float(limits.travel_high[j]))}"
            yield f"{channel.name} is expected between {low} and {high} (limits {allowed})"
        asked = (question for question in self.questions for _ in question.pairs)
        for question, one in zip(asked, self.design.separated, strict=True):
            if not self._alike(one):
                yield self._expected(question, one)

    def _expected(self, question: Question, one: Separated) -> str:
        names = [self.channels.outputs[j] for j in question.outputs]
        apart = " and ".join(amount(d, c.unit, 2) for d, c in zip(one.difference, names, strict=True))
        noise = " and ".join(amount(float(s), c.unit, 2) for s, c in zip(question.noise.deviations, names, strict=True))
        d = min(one.d)
        if question.interval:
            return f"{question.interval}: its interval would have {percent(narrowed(d))} of its width"
        needed = (
            f"; about {number(np.ceil(ENOUGH / d), 2)} such records decide" if d > 1 and one.chance < CERTAIN else ""
        )
        return (
            f"{one.first} against {one.second}: after a new fit they still differ by {apart} RMS, where the noise is "
            f"{noise}; their log-likelihoods move {number(d / 2, 2)} apart, which decides with a chance of "
            f"{_chance(one.chance)}{needed}"
        )

    def _wider(self) -> Iterator[str]:
        if self.design is not None and all(map(self._alike, self._undecided)):
            return
        for name, design in self.wider.items():
            chance = _chance(design.chance if design else 0.0)
            yield f"twice the {name}: a decision with a chance of {chance}".replace("the all limits", "all limits")


def is_alike(one: Separated, designs: Sequence[Design]) -> bool:
    """Tell whether none of these records would set two rivals apart."""
    pair = (one.first, one.second)
    same = [other for design in designs for other in design.separated if (other.first, other.second) == pair]
    return max(d for other in same for d in other.d) < ALIKE


def narrowed(d: float) -> float:
    """Compute the share of its width that an interval keeps after a record that sets its ends D apart.

    The information about a number of variance c grows by D / (2 r)^2, r = 1.96 sqrt(c) the half width.
    """
    return float(1 / np.sqrt(1 + d / (2 * 1.96) ** 2))


def _chance(share: float) -> str:
    return "more than 99 %" if share > 0.99 else "less than 1 %" if share < 0.01 else percent(share)
