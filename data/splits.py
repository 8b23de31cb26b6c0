"""Splits in time, never joined and never shuffled, and the checks that every data set passes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from simgap.records import Channels, Dataset, Experiment, TrainingSet, UnusableInput

Experiments = tuple[Experiment, ...]

LARGEST_DEFAULT_N_INIT = 20
NEAR_THE_END = 20  # a split moves by this part of all samples, so that it cuts no record into a stump


def split_in_time(record: Experiment) -> tuple[Experiments, Experiments, Experiments]:
    """Cut a record into its first 60 % to train on, 20 % to validate on, and the last 20 % to test on."""
    a, b = len(record) * 3 // 5, len(record) * 4 // 5
    train, valid, test = record[:a], record[a:b], record[b:]
    return (replace(train, name="train"),), (replace(valid, name="valid"),), (replace(test, name="test"),)


def split_pieces(records: Sequence[Experiment]) -> tuple[Experiments, Experiments, Experiments]:
    """Part several records, in order of time, where 60 and 80 % of all samples lie.

    A split next to the end of a record falls there; else it cuts the record.
    """
    stops = np.cumsum([len(record) for record in records])
    total = int(stops[-1])
    cuts = [0]
    for share in (3, 4):
        cut = total * share // 5
        nearest = int(stops[np.argmin(np.abs(stops - cut))])
        cuts.append(nearest if abs(nearest - cut) <= total // NEAR_THE_END else cut)
    splits: list[Experiments] = []
    for low, high in zip(cuts, [*cuts[1:], total], strict=True):
        inside = []
        for stop, record in zip(stops, records, strict=True):
            start = int(stop) - len(record)
            a, b = max(low - start, 0), min(high - start, len(record))
            if a < b:
                inside.append(record[a:b])
        splits.append(tuple(inside))
    train, valid, test = splits
    return train, valid, test


def hold_out_tails(records: Sequence[Experiment]) -> tuple[Experiments, Experiments]:
    """Cut off the last quarter of each record, as an experiment of its own."""
    cuts = [len(record) - len(record) // 4 for record in records]
    heads = tuple(record[:cut] for record, cut in zip(records, cuts, strict=True))
    tails = tuple(replace(record[cut:], name=f"{record.name}_tail") for record, cut in zip(records, cuts, strict=True))
    return heads, tails


def default_n_init(records: Sequence[Experiment]) -> int:
    """Take a tenth of the shortest experiment, at least 1 and at most 20 samples."""
    return min(LARGEST_DEFAULT_N_INIT, max(1, min(map(len, records)) // 10))


def assemble(
    name: str,
    splits: tuple[Sequence[Experiment], Sequence[Experiment], Sequence[Experiment]],
    channels: Channels,
    n_init: int | None,
    source: str,
) -> Dataset:
    """Make a data set of training, validation and test experiments; `source` names it in the messages.

    Raises UnusableInput when an experiment is not longer than n_init or a signal never moves in training.
    """
    train, valid, test = map(tuple, splits)
    every = train + valid + test
    n_init = default_n_init(every) if n_init is None else n_init
    for experiment in every:
        if len(experiment) <= n_init:
            rows = f"{len(experiment)} row{'' if len(experiment) == 1 else 's'}"
            why = f"experiment {experiment.name} has {rows}, no more than the {n_init} (n_init) that start a simulation"
            help_ = "record more samples" if n_init == 1 else "record longer experiments or lower n_init"
            raise UnusableInput(f"{source}: {why}; {help_}")
    _check_that_all_move(train, channels, source)
    return Dataset(name, TrainingSet(train, valid, n_init, channels), test, n_init, channels)


def _check_that_all_move(train: Experiments, channels: Channels, source: str) -> None:
    for what, signal, listed in (("input", "u", channels.inputs), ("output", "y", channels.outputs)):
        values = np.concatenate([getattr(experiment, signal) for experiment in train])  # [T, n]
        for column, channel in enumerate(listed):
            if np.ptp(values[:, column]) == 0:
                raise UnusableInput(
                    f"{source}: {what} column {channel.name!r} is {values[0, column]} in all {len(values)} rows of the "
                    f"training split; leave it out of the {what}s or record it while it moves"
                )
