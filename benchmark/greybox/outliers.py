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
APART = 3.0  # times the next smaller one: what stands apart from all others
RARE = 0.01  # of the readings


@dataclass(frozen=True, eq=False)
class Outliers:
    """How many readings of which output are off, by how much, and what they make of the squared error."""

    output: int
    rate: float
    size: float
    share: float
    log_likelihood_ratio: float
    least: float = 0.0  # what is less far off belongs to the others


def flag(
    errors: Float[np.ndarray, "E T ny"], mask: Bool[np.ndarray, "E T"], outliers: Sequence[Outliers] = ()
) -> Bool[np.ndarray, "E T ny"]:
    """Flag readings whose error stands out from the median of the five around it, as far as the outliers' least do."""
    off = _off(errors, mask)
    flags = _far(off, mask)
    for one in outliers:
        if one.least:
            flags[:, :, one.output] = np.abs(off[:, :, one.output]) > one.least
    return flags


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


def find_glitches(errors: Float[np.ndarray, "E T ny"], mask: Bool[np.ndarray, "E T"]) -> list[Outliers]:
    """Find outputs with single readings that are farther off than all others by a gap, however the others are spread.

    The errors of a plain model of many runs have heavy tails of their own, which hide what no machine could do.
    """
    off, found = _off(errors, mask), []
    for j in range(errors.shape[2]):
        alone, e = np.abs(off[:, :, j][mask]), errors[:, :, j][mask]
        largest = np.sort(alone)[::-1][: max(FEWEST + 1, int(RARE * len(alone)))]
        ratios = largest[:-1] / np.maximum(largest[1:], 1e-12 * largest[0] + 1e-300)
        count = int(np.argmax(ratios)) + 1
        if count < FEWEST or count + 1 >= len(largest) or ratios[count - 1] < APART or not largest[0] > 0:
            continue
        least = float(np.sqrt(largest[count - 1] * largest[count]))
        bad = alone > least
        share = 1 - float(np.sum(e[~bad] ** 2) / np.sum(e**2))
        size, ratio = float(np.sqrt(np.mean(alone[bad] ** 2))), _two_sizes(alone[alone > 0], bad[alone > 0])
        found.append(Outliers(j, count / len(e), size, share, ratio, least))
    return found


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
    flags = flag(errors, records.mask, outliers)[:, :, [o.output for o in outliers]].any(axis=2)
    return replace(records, mask=records.mask & ~flags)
