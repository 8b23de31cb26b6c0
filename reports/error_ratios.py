"""Which rows of a data set cannot be told from the best one: ratios of free-run errors with their intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np
from jaxtyping import Float

from simgap.error_views.correlation import correlation_time
from simgap.error_views.gain_interval import blocks_of, least_share, share_with_interval
from simgap.metrics import is_finite, pool, spread
from simgap.reports.collection import Collection
from simgap.reports.pooling import Standing

HOW_TO_READ = (
    "Error / best: the free-run error of a row divided by that of the best row, over all outputs in units of their "
    "spread, with its 95 % interval. Where it holds 1, the row is not distinguishable from the best one, and its fit "
    "is italic (underlined on a terminal). 'Record too short': the interval holds 1, and three times the ratio too."
)
HOW_IT_IS_MADE = (
    "Italic (underlined on a terminal): not distinguishable from the best row, because the 95 % interval of the ratio "
    "of their errors holds 1. It comes from blocks of the test records that are longer than the memory of the errors; "
    "a record of few such blocks is too short to tell. Each row is compared by itself, with the row that is "
    "best on this very test, so that of many rows that are equally good chance puts some behind."
)
TELLS_NOTHING = 3.0  # times the ratio, and still within the interval
ROUNDING = 1e-7  # of a stored run, in units of the output's spread; smaller errors are not compared


@dataclass(frozen=True)
class ErrorRatio:
    """The free-run error of a row divided by that of the best row of its data set, and the 95 % interval."""

    ratio: float
    low: float
    high: float

    @property
    def undecided(self) -> bool:
        """Whether chance alone may have put the one before the other, in a record that could have told."""
        return self.low <= 1 <= self.high and not self.too_short

    @property
    def too_short(self) -> bool:
        """Whether the record tells nothing: the interval holds 1, and three times the ratio too."""
        return self.low <= 1 and self.high > TELLS_NOTHING * self.ratio

    def __str__(self) -> str:
        """Write the ratio with its interval, or that the record is too short for one."""
        interval = "record too short" if self.too_short else f"{self.low:.4g} to {self.high:.4g}"
        return f"{self.ratio:.4g} ({interval})"


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

    Errors are in units of each output's spread. The interval is that of a gain (`share_with_interval`), or lies above 1
    where the difference of the two losses does (Diebold and Mariano, J. Business & Economic Statistics 13, 1995), from
    blocks longer than its own memory: a slow error of the best model, which is small, does not make those longer.
    """
    losses, least = (np.mean(np.sum(e**2, axis=2), axis=0) + ROUNDING**2 for e in (errors, of_best))
    signals = [signal for e in (errors, of_best) for of_seed in e for signal in of_seed.T]
    memory = max(correlation_time(signal, lengths, 0)[0] for signal in signals)
    share, low, high = share_with_interval(losses, least, lengths, memory)
    starts, correction = blocks_of(losses - least, lengths)
    if low <= 0 < share and len(starts) > 1:
        low = max(low, least_share(losses, least, starts, correction))
    return ErrorRatio(*(1 / (1 - each) if each < 1 else math.inf for each in (share, low, high)))


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
