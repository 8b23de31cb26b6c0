"""A log that holds the output of somebody's simulation beside the measured one, as two data sets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from simgap.data.formats.headings import find, heading_of, listed
from simgap.records import Channel, Dataset, Experiment, UnusableInput


def split_off(dataset: Dataset, columns: Sequence[str]) -> tuple[Dataset, Dataset]:
    """Part a data set into the measured one and the simulated one: same inputs, outputs from `columns`.

    The i-th column simulates the i-th of the other outputs, whose name, unit and kind it gets.
    Raises UnusableInput for a column that is no output, too few or too many of them, and another unit.
    """
    outputs = dataset.channels.outputs
    names = [channel.name for channel in outputs]
    simulated = []
    for column in columns:
        found = find(names, column) or find(names, heading_of(column).name)
        if len(found) != 1:
            raise UnusableInput(f"{dataset.name} has no output {column!r} that was simulated; "
                                f"there are {listed(names)}")  # fmt: skip
        simulated.append(found[0])
    measured = [i for i in range(len(names)) if i not in simulated]
    if len(measured) != len(simulated):
        raise UnusableInput(
            f"{dataset.name}: {len(simulated)} simulated columns for {len(measured)} measured outputs; "
            f"name one for each output, in the same order"
        )
    for i, j in zip(measured, simulated, strict=True):
        _check_unit(dataset.name, outputs[i], outputs[j])
    return _with(dataset, measured, measured), _with(dataset, simulated, measured)


def check_simulation(dataset: Dataset, simulated: Dataset) -> None:
    """Raise UnusableInput unless every experiment has been simulated, under its inputs and over its length."""
    for split, ours, theirs in (
        ("training", dataset.training.train, simulated.training.train),
        ("validation", dataset.training.valid, simulated.training.valid),
        ("test", dataset.test, simulated.test),
    ):
        alike = len(ours) == len(theirs) and all(
            x.u.shape == z.u.shape and x.y.shape == z.y.shape and (x.u == z.u).all()
            for x, z in zip(ours, theirs, strict=False)
        )
        if not alike:
            raise UnusableInput(
                f"{simulated.name}: its {split} experiments are not simulations of those of {dataset.name}; "
                f"simulate each under the same inputs, sample by sample"
            )


def _with(dataset: Dataset, columns: Sequence[int], named_as: Sequence[int]) -> Dataset:
    channels = replace(dataset.channels, outputs=tuple(dataset.channels.outputs[i] for i in named_as))

    def cut(experiments: Sequence[Experiment]) -> tuple[Experiment, ...]:
        return tuple(replace(x, y=x.y[:, list(columns)]) for x in experiments)

    training = dataset.training
    return replace(
        dataset,
        training=replace(training, train=cut(training.train), valid=cut(training.valid), channels=channels),
        test=cut(dataset.test),
        channels=channels,
        sha256="",
    )


def _check_unit(name: str, measured: Channel, simulated: Channel) -> None:
    if simulated.unit and simulated.unit != measured.unit:
        raise UnusableInput(
            f"{name}: {simulated.name} is simulated in {simulated.unit} and {measured.name} measured in "
            f"{measured.unit or 'no unit'}; bring both to one unit"
        )
