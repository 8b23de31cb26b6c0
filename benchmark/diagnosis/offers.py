"""When the catalogue explains nothing: a formula for the missing force, from a sparse regression."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from simgap.findings import Offer
from simgap.records import Channel

THRESHOLDS = (0.5, 0.3, 0.2, 0.1, 0.05)
WORSE = 0.05  # of the variance that the fullest formula explains may be lost for a shorter one


def formula(leftover: Any, channel: Channel) -> Offer:
    """The shortest formula for the missing force that predicts the error nearly as well as the fullest one.

    Sequentially thresholded least squares (Brunton, Proctor, Kutz 2016), by pysindy, of the error on what each
    candidate force would do to the output; x, v and the inputs are in units of their spread.
    """
    from pysindy.optimizers import STLSQ

    responses = leftover.effects / (np.sqrt(np.mean(leftover.effects**2, axis=0)) + 1e-300)
    scale = float(np.std(leftover.errors)) or 1.0
    target = (leftover.errors / scale)[:, None]
    tried = []
    for threshold in THRESHOLDS:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            optimizer = STLSQ(threshold=threshold, alpha=1e-3)
            optimizer.fit(responses, target)
        coefficients = np.asarray(optimizer.coef_)[0]
        rest = target[:, 0] - responses @ coefficients
        tried.append((1 - float(np.mean(rest**2)), coefficients))
    best = max(share for share, _ in tried)
    share, coefficients = min(
        (trial for trial in tried if trial[0] > best - WORSE), key=lambda trial: np.count_nonzero(trial[1])
    )
    order = np.argsort(-np.abs(coefficients))
    largest = np.max(np.abs(coefficients)) or 1.0
    parts = [f"{coefficients[i] / largest:+.2g} {leftover.names[i]}" for i in order if coefficients[i]]
    return Offer(channel.name, "force ~ " + " ".join(parts), max(0.0, share), "relative")
