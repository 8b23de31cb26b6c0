"""Single readings that are far off: found in the errors, left out of every fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from numpy.lib.stride_tricks import sliding_window_view

from simgap.greybox.samples import Records

FAR = 6.0  # robust standard deviations; Gaussian noise goes there twice in 1e9 readings
FEWEST = 3


@dataclass(frozen=True, eq=False)
class Outliers:
    """How many readings of which output are off, by how much, and what they make of the squared error."""

    output: int
    rate: float
    size: float
    share: float
    log_likelihood_ratio: float


def flag(errors: Float[np.ndarray, "E T ny"], mask: Bool[np.ndarray, "E T"]) -> Bool[np.ndarray, "E T ny"]:
    """Flag readings whose error stands out from the median of the five around it.

    The errors of a model that is wrong are large for a while; those of a bad reading only once. Beyond the ends of a
    record its neighbours are mirrored: the last reading repeated would be its own neighbourhood.
    """
    padded = np.pad(errors, ((0, 0), (2, 2), (0, 0)), mode="reflect")
    around = np.median(sliding_window_view(padded, 5, axis=1), axis=-1)
    off = np.where(mask[:, :, None], errors - around, 0.0)
    flags = np.zeros(errors.shape, dtype=bool)
    for j in range(errors.shape[2]):
        deviation = 1.4826 * np.median(np.abs(off[:, :, j][mask]))
        if deviation > 0:
            flags[:, :, j] = (np.abs(off[:, :, j]) > FAR * deviation) & mask
    return flags


def find_outliers(
    errors: Float[np.ndarray, "E T ny"], mask: Bool[np.ndarray, "E T"], resolution: float | np.ndarray = 0.0
) -> list[Outliers]:
    """Find outputs with enough readings that are off: log-likelihood of errors of two sizes against one size.

    `resolution` is the smallest error of each output that means anything.
    """
    flags = flag(errors, mask)
    least = np.broadcast_to(resolution, errors.shape[2:])
    outliers = []
    for j in range(errors.shape[2]):
        e, bad = errors[:, :, j][mask], flags[:, :, j][mask]
        count, n = int(bad.sum()), len(e)
        if count < FEWEST or count > 0.2 * n:
            continue
        one, good, far = np.std(e), np.std(e[~bad]), np.sqrt(np.mean(e[bad] ** 2))
        if not far > good > 0 or far <= least[j]:
            continue  # they stand out from their neighbours, but are no larger than the others
        rate = count / n
        ratio = n * np.log(one) - (n - count) * np.log(good / (1 - rate)) - count * np.log(far / rate)
        if ratio > 15:
            share = 1 - float(np.sum(e[~bad] ** 2) / np.sum(e**2))
            outliers.append(Outliers(j, rate, float(far), share, float(ratio)))
    return outliers


def without_outliers(records: Records, errors: Float[np.ndarray, "E T ny"], outliers: Sequence[Outliers]) -> Records:
    """Mask the readings that are off."""
    flags = flag(errors, records.mask)[:, :, [o.output for o in outliers]].any(axis=2)
    return replace(records, mask=records.mask & ~flags)
