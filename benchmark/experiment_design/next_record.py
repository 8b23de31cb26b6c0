"""`simgap.next_record`: what the records leave undecided, and the record that would decide it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from simgap.cores import all_cores
from simgap.data.formats.plant_table import with_known
from simgap.data.kinds import with_kinds
from simgap.data.loading import read
from simgap.diagnosis import doubts
from simgap.experiment_design.answer import CERTAIN, NextRecord, is_alike, narrowed
from simgap.experiment_design.limits import Limits, Range, limits_of
from simgap.experiment_design.rivals import WIDE, Question, question_of, with_outputs
from simgap.experiment_design.search import Design, best_record
from simgap.greybox.identification import Identified, identify
from simgap.records import Channels, Dataset

LENGTHS = (1, 2, 4)  # of the record, times that of the longest training record


def next_record(
    data: Any,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    dt: float | None = None,
    seed: int = 0,
    kind: str | Mapping[str, str] | None = None,
    known: Mapping[str, Any] | None = None,
    input_range: Range | Mapping[str, Range] | None = None,
    rate: float | Mapping[str, float] | None = None,
    seconds: float | None = None,
    travel: Range | Mapping[str, Range] | None = None,
) -> NextRecord:
    """Name the models that training and validation records do not tell apart, and design the record that would.

    `data`, `inputs`, `outputs`, `dt`, `kind` and `known` as in `simgap.diagnose`. Limits of the record: the range of
    the input, its rate (in its unit per second), its length in seconds, and the travel of the output; where there are
    several inputs or outputs, by their names. What is left out is taken from the training records; the record is up to
    four times as long as these, where a shorter one would not decide. `seed` draws the signals that are tried. Raises
    UnusableInput.
    """
    dataset = data if isinstance(data, Dataset) else read(data, inputs, outputs, dt).dataset
    dataset = with_known(with_kinds(dataset, kind), known)
    limits = limits_of(dataset, input_range, rate, seconds, travel)
    training, channels = dataset.training, dataset.channels
    doubt = doubts.of_records(training, channels)
    if doubt:
        return NextRecord(dataset.name, channels, limits, (), None, doubt=doubt)
    with all_cores():
        identified = identify(training)
        questions = with_outputs([question_of(one) for one in identified], channels)
        design, wider = None, {}
        if any(question.pairs for question in questions):
            rivals = any(question.pairs and not question.interval for question in questions)
            lengths = LENGTHS if seconds is None else LENGTHS[:1]
            limits, design = _long_enough(questions, limits, seed, lengths)
            if rivals and (design is None or design.chance < CERTAIN):
                wider = _wider(questions, limits, design, seed)
    return NextRecord(dataset.name, channels, limits, tuple(questions), design, wider, _untold(identified, channels))


def _long_enough(
    questions: Sequence[Question], limits: Limits, seed: int, lengths: Sequence[int]
) -> tuple[Limits, Design | None]:
    """Design the shortest record of these lengths, times the usual, that settles all; else what separates the most."""
    found: list[tuple[Limits, Design]] = []
    for times in lengths:
        longer = limits.longer(times)
        design = best_record(questions, longer, seed)
        if design is not None:
            found.append((longer, design))
            if _settles(questions, design):
                break
    return max(found, key=lambda one: one[1].worth, default=(limits, None))


def _settles(questions: Sequence[Question], design: Design) -> bool:
    """Tell whether a record decides between rivals that any can, and leaves no interval that is worth another one."""
    asked = [question for question in questions for _ in question.pairs]
    return all(
        narrowed(min(one.d)) * question.width <= WIDE
        if question.width
        else one.chance >= CERTAIN or is_alike(one, [design])
        for question, one in zip(asked, design.separated, strict=True)
    )


def _wider(questions: Sequence[Question], limits: Limits, design: Design | None, seed: int) -> dict[str, Design | None]:
    """Design records with each limit, and with all, twice as wide, coarsely; only with all where that is all there is.

    Where nothing within all limits twice as wide sets an undecided pair apart, no single limit does.
    """
    wider = limits.relaxed()
    widest = {"all limits": best_record(questions, wider.pop("all limits"), seed, rounds=1)}
    designs = [one for one in (design, *widest.values()) if one is not None]
    undecided = [one for one in (design.separated if design else ()) if one.chance < CERTAIN]
    if design is not None and all(is_alike(one, designs) for one in undecided):
        return widest
    return {name: best_record(questions, more, seed, rounds=1) for name, more in wider.items()} | widest


def _untold(identified: Sequence[Identified], channels: Channels) -> str:
    """Say what no record of these columns can tell."""
    plants = [one.plant.estimate.plant for one in identified]
    known = channels.plant
    moves = any(plant.kind in ("position", "velocity") and not plant.imposed for plant in plants)
    constants = (known.mass, known.inertia) if known is not None else ()
    if not moves or any(constant is not None and (constant.certain or constant.column) for constant in constants):
        return ""
    return (
        "No record of these columns tells a gain from an inertia: they show gain over inertia, and nothing else. What "
        "would: a known mass or inertia (--known mass=.. or a table [plant]), or a measured force."
    )
