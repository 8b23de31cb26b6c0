"""Which rows of a data set cannot be told from the best one: ratios of free-run errors with their intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np
from jaxtyping import Float

from simgap.error_views.correlation import correlation_time
from simgap.error_views.gain_interval import share_with_interval
from simgap.metrics import is_finite, pool, spread
from simgap.reports.collection import Collection
from simgap.reports.pooling import Standing

HOW_TO_READ = (
    "Error / best: the free-run error of a row divided by that of the best row, over all outputs in units of their "
    "spread, with its 95 % interval. Where it holds 1, the row is not distinguishable from the best one, and its fit "
    "is italic (underlined on a terminal)."
)
HOW_IT_IS_MADE = (
    "Italic (underlined on a terminal): not distinguishable from the best row, because the 95 % interval of the ratio "
    "of their errors holds 1. It comes from blocks of the test records that are longer than the memory of the errors, "
    "and is wide where a record is not much longer than that. Each row is compared by itself, with the row that is "
    "best on this very test, so that of many rows that are equally good chance puts some behind."
)
ROUNDING = 1e-7  # of a stored run, in units of the output's spread; smaller errors are not compared


@dataclass(frozen=True)
class ErrorRatio:
    """The free-run error of a row divided by that of the best row of its data set, and the 95 % interval."""

    ratio: float
    low: float
    high: float

    @property
    def undecided(self) -> bool:
        """Whether chance alone may have put the one before the other."""
        return self.low <= 1 <= self.high


Ratios = Mapping[str, Mapping[str, ErrorRatio]]  # by data set and label of the model; the best row has none


def error_ratios(collection: Collection, suite: str) -> Ratios:
    """Compare the rows of each data set with its best row, where the free runs of both and the data are at hand."""
    standings = collection.standings[suite]
    datasets = dict.fromkeys(standing.dataset for standing in standings)
    return {dataset: _of_dataset(collection, suite, [s for s in standings if s.dataset == dataset])
            for dataset in datasets}  # fmt: skip


def _of_dataset(collection: Collection, suite: str, standings: Sequence[Standing]) -> dict[str, ErrorRatio]:
    best, *others = sorted(standings, key=attrgetter("median_fit"), reverse=True)
    if (of_best := _errors(collection, suite, best)) is None:
        return {}
    lengths = np.array([part.shape[1] for part in of_best])
    ratios = {}
    for other in others:
        if (errors := _errors(collection, suite, other)) is not None:
            ratios[other.model] = error_ratio(np.concatenate(errors, axis=1), np.concatenate(of_best, axis=1), lengths)
    return ratios


def error_ratio(
    errors: Float[np.ndarray, "S N ny"], of_best: Float[np.ndarray, "R N ny"], lengths: np.ndarray
) -> ErrorRatio:
    """Divide the error of one model by that of the best, over experiments of such lengths end to end.

        ratio = sqrt(mean(losses) / mean(least)),   a loss: the sum over outputs of e_t^2, averaged over seeds

    Errors are in units of each output's spread. The interval is that of a gain (`share_with_interval`): of the
    difference of the two losses, from blocks longer than its memory, so that an error that both share cancels.
    """
    losses, least = (np.mean(np.sum(e**2, axis=2), axis=0) + ROUNDING**2 for e in (errors, of_best))
    signals = [signal for e in (errors, of_best) for of_seed in e for signal in of_seed.T]
    memory = max(correlation_time(signal, lengths, 0)[0] for signal in signals)
    shares = share_with_interval(losses, least, lengths, memory)
    ratio, low, high = (1 / (1 - share) if share < 1 else math.inf for share in shares)
    return ErrorRatio(ratio, low, high)


def _errors(collection: Collection, suite: str, standing: Standing) -> list[np.ndarray] | None:
    """Read the errors [S, n, ny] of all seeds on each test experiment; None if one is missing.

    They are in units of each output's spread, the one of the fit in percent: about the mean of each experiment, pooled.
    """
    dataset = collection.copy_of(standing.dataset).dataset
    if dataset is None:
        return None
    found = [a for a in collection.artefacts_of(suite, standing).values() if a.data_sha256 == dataset.sha256]
    if len(found) < len({row.seed for row in standing.rows}):
        return None
    measured = {x.name: x.y[dataset.n_init :] for x in dataset.test}
    scale = _spreads(list(measured.values()))
    errors = []
    for name, y in measured.items():
        runs = [artefact.runs[name].astype(np.float64) for artefact in found if name in artefact.runs]
        if len(runs) < len(found) or any(run.shape != y.shape or not is_finite(run) for run in runs):
            return None
        errors.append((y - np.stack(runs)) / scale)
    return errors


def _spreads(measured: Sequence[np.ndarray]) -> Float[np.ndarray, " ny"]:
    lengths = [len(y) for y in measured]
    pooled = [pool([spread(y[:, i]) for y in measured], lengths) for i in range(measured[0].shape[1])]
    return np.where(np.array(pooled) > 0, pooled, 1.0)
