"""Checks of the data that need no model."""

from __future__ import annotations

import numpy as np

from simgap.diagnosis.doubts import ENOUGH
from simgap.greybox.held_out import BLOCKS
from simgap.greybox.machine_baseline import spread
from simgap.greybox.samples import PIECE, excerpts, is_cut
from simgap.records import Dataset
from simgap.wording import amount


def limitations(dataset: Dataset) -> tuple[str, ...]:
    """Check the training data; return a sentence for whatever limits what a diagnosis can find in them."""
    training = dataset.training
    sentences = []
    samples = sum(map(len, training.train))
    if BLOCKS <= samples < ENOUGH:
        sentences.append(f"There are only {samples} training samples: weak effects cannot be told from noise.")
    if not training.without_mere_starts().valid:
        sentences.append("There are no validation data: effects were accepted on the training data alone.")
    if len(training.train) == 1:
        sentences.append(
            "There is one training experiment: a drift of the sensor or of the load shows only where it goes on evenly."
        )
    looked_at = excerpts if dataset.channels.plant is None else spread
    if is_cut(looked_at(training.train), training.train):
        sentences.append(
            f"There are many training samples, so causes are looked for in pieces of {PIECE}: a drift shows "
            "only where it goes on evenly."
        )
    for i, channel in enumerate(dataset.channels.outputs):
        y = np.concatenate([x.y[:, i] for x in training.train])
        for limit, word in ((y.max(), "largest"), (y.min(), "smallest")):
            times = int(np.sum(y == limit))
            if times > max(5, 0.005 * len(y)) and np.ptp(y) > 0:
                sentences.append(
                    f"{channel.name} stands at its {word} value, {amount(limit, channel.unit, 4)}, in {times} samples: "
                    "the machine or the sensor may have a limit there."
                )
        values = np.unique(y)
        if 3 <= len(values) < 0.05 * len(y) and len(values) < 500:
            sentences.append(f"{channel.name} takes only {len(values)} different values: its resolution is coarse.")
    for i, channel in enumerate(dataset.channels.inputs if dataset.channels.plant is None else ()):
        u = np.concatenate([x.u[:, i] for x in training.train])
        if u.min() >= 0 or u.max() <= 0:
            sentences.append(
                f"The input {channel.name} never changes its sign: what happens around zero input, such as a dead "
                "zone, cannot show."
            )
    return tuple(sentences)
