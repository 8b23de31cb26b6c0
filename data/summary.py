"""`describe`: what a data set holds, in counts and physical units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from simgap.records import Channel, Dataset, Experiment


def describe(dataset: Dataset) -> dict[str, Any]:
    """Sum up counts, lengths, sampling time and, for each channel, its spread over the training split.

    The result holds only text, numbers, lists and dicts, so that it can be written as JSON.
    """
    training = dataset.training
    splits = {"train": training.train, "valid": training.valid, "test": dataset.test}
    u = np.concatenate([experiment.u for experiment in training.train])  # [N, nu]
    y = np.concatenate([experiment.y for experiment in training.train])  # [N, ny]
    return {
        "name": dataset.name,
        "sha256": dataset.sha256,
        "sampling_time": training.dt,
        "n_init": dataset.n_init,
        "splits": {name: _split(experiments) for name, experiments in splits.items()},
        "inputs": [
            _channel(channel, u[:, i]) | {"white_experiments": _white([e.u[:, i] for e in training.train])}
            for i, channel in enumerate(dataset.channels.inputs)
        ],
        "outputs": [_channel(channel, y[:, i]) for i, channel in enumerate(dataset.channels.outputs)],
    }


def _white(inputs: Sequence[np.ndarray]) -> int:
    """Count the experiments whose input passes for white noise."""
    from simgap.data.whiteness import is_white  # SciPy, which a listing does not need

    return sum(map(is_white, inputs))


def _split(experiments: Sequence[Experiment]) -> dict[str, Any]:
    lengths = [len(experiment) for experiment in experiments]
    return {
        "experiments": len(lengths),
        "samples": sum(lengths),
        "shortest": min(lengths, default=0),
        "longest": max(lengths, default=0),
        "names": [experiment.name for experiment in experiments],
    }


def _channel(channel: Channel, values: np.ndarray) -> dict[str, Any]:
    return {
        "name": channel.name,
        "unit": channel.unit,
        "kind": channel.kind,
        "std": float(values.std()),
        "low": float(values.min()),
        "high": float(values.max()),
    }
