"""Single readings that are far off: found in the errors, left out of every fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from numpy.lib.stride_tricks import sliding_window_view
from scipy.stats import norm
from scipy.stats import t as student

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
    """Flag readings whose error stands out from the median of the five around it."""
    return _far(_off(errors, mask), mask)


def _far(off: Float[np.ndarray, "E T ny"], mask: Bool[np.ndarray, "E T"]) -> Bool[np.ndarray, "E T ny"]:
    flags = np.zeros(off.shape, dtype=bool)
    for j in range(off.shape[2]):
        deviation = 1.4826 * np.median(np.abs(off[:, :, j][mask]))
        if deviation > 0:
            flags[:, :, j] = (np.abs(off[:, :, j]) > FAR * deviation) & mask
    return flags


def _off(errors: Float[np.ndarray, "E T ny"], mask: Bool[np.ndarray, "E T"]) -> Float[np.ndarray, "E T ny"]:
    """Compute by how much each error is off the median of the five around it.

    The errors of a model that is wrong are large for a while; those of a bad reading only once. Beyond the ends of a
    record its neighbours are mirrored: the last reading repeated would be its own neighbourhood.
    """
    padded = np.pad(errors, ((0, 0), (2, 2), (0, 0)), mode="reflect")
    around = np.median(sliding_window_view(padded, 5, axis=1), axis=-1)
    return np.where(mask[:, :, None], errors - around, 0.0)


def find_outliers(
    errors: Float[np.ndarray, "E T ny"], mask: Bool[np.ndarray, "E T"], resolution: float | np.ndarray = 0.0
) -> list[Outliers]:
    """Find outputs with enough readings that are off: log-likelihood of errors of two sizes against one size.

    Errors that are just now and then larger, with no gap between the two, are better described by Student's t
    (Lange, Little, Taylor 1989), and no reading is bad. `resolution` is the smallest error of each output that means
    anything.
    """
    off = _off(errors, mask)
    flags = _far(off, mask)
    least = np.broadcast_to(resolution, errors.shape[2:])
    outliers = []
    for j in range(errors.shape[2]):
        e, bad, alone = errors[:, :, j][mask], flags[:, :, j][mask], off[:, :, j][mask]
        count, n = int(bad.sum()), len(e)
        if count < FEWEST or count > 0.2 * n:
            continue
        far = np.sqrt(np.mean(e[bad] ** 2))
        if not far > np.std(e[~bad]) > 0 or far <= least[j]:
            continue  # they stand out from their neighbours, but are no larger than the others
        ratio, moved = _two_sizes(e, bad), alone != 0
        if ratio > 15 and _two_sizes(alone[moved], bad[moved]) > _heavy_tails(alone[moved]):
            share = 1 - float(np.sum(e[~bad] ** 2) / np.sum(e**2))
            outliers.append(Outliers(j, count / n, float(far), share, ratio))
    return outliers


def _two_sizes(e: Float[np.ndarray, " N"], bad: Bool[np.ndarray, " N"]) -> float:
    """Log-likelihood of errors of two sizes against that of one size, all of them normal."""
    n, count = len(e), int(bad.sum())
    good, far, rate = np.std(e[~bad]), np.sqrt(np.mean(e[bad] ** 2)), count / n
    return float(n * np.log(np.std(e)) - (n - count) * np.log(good / (1 - rate)) - count * np.log(far / rate))


def _heavy_tails(e: Float[np.ndarray, " N"]) -> float:
    """Log-likelihood of errors under Student's t against that of one size, all of them normal."""
    spread = float(np.std(e))
    with np.errstate(all="ignore"):  # on the way to the maximum
        freedom, _, scale = student.fit(e / spread, floc=0)
    return float(np.sum(student.logpdf(e / spread, freedom, 0, scale) - norm.logpdf(e / spread)))


def without_outliers(records: Records, errors: Float[np.ndarray, "E T ny"], outliers: Sequence[Outliers]) -> Records:
    """Mask the readings that are off."""
    flags = flag(errors, records.mask)[:, :, [o.output for o in outliers]].any(axis=2)
    return replace(records, mask=records.mask & ~flags)
