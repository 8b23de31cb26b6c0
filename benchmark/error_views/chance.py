"""Significance of a view: the share of the squared error that it explains, and how often chance explains as much.

A simulation error is autocorrelated (drift, coloured noise, slow dynamics), so that the F test for independent samples
finds almost everything significant. Each test in this file allows for the correlation of the error.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int
from scipy.fft import dct
from scipy.stats import beta, f

from simgap.error_views.correlation import correlation_time, means

DRAWS = 1000  # of random signs
LARGE = 256  # terms whose signs are drawn one by one
SHUFFLES = 200  # of the blocks over the groups


def by_bins(
    error: Float[np.ndarray, " N"],
    labels: Int[np.ndarray, " N"],
    lengths: Sequence[int],
    seed: int,
    parents: Sequence[int] = (),
) -> tuple[float, float]:
    """Compute the share of the squared error that the means of bins explain beyond chance, and its p-value.

        Q = sum_b n_b (m_b - m)^2,   m_b the mean error of bin b, n_b its samples

    Experiments of `lengths` samples stand end to end; samples labelled -1 are in no bin. `parents` names a coarser bin
    for every bin: then m is the mean of the parent, and only what the finer bins add counts.

    The p-value compares Q with surrogates of the error: the cosine transform of each experiment with a random sign
    for every coefficient. They have the spectrum of the error and no relation to the bins. Random circular shifts have
    that too, but a record of N samples and correlation time tau has no more than N/tau different ones, and a ramp
    gets a jump where it wraps: on single records of 200 samples of AR(1) noise with a pole at 0.9, shifts found an
    effect in 5 % of cases at the 1 % level. With c_k the cosine coefficients of the error and i_k those of the bins'
    indicators, signs s_k turn the bin sums into S = sum_k s_k c_k i_k, and Q = S'AS: no surrogate is transformed back.
    Cosines decorrelate noise with a pole near 1: Ahmed, Natarajan, Rao, IEEE Trans. Comput. C-23 (1974) 90. Surrogates
    with random phases: Theiler et al., Physica D 58 (1992) 77.
    """
    indicator = (labels[:, None] == np.arange(labels.max() + 1)).astype(float)  # [N, B]
    count = indicator.sum(axis=0)  # [B]
    form = np.diag(1 / count)  # A [B, B]
    parent_of = np.array(parents or [0] * len(count))
    for parent in np.unique(parent_of):
        inside = (parent_of == parent).astype(float)
        form -= np.outer(inside, inside) / (inside @ count)

    centred = error - error.mean()
    sums = indicator.T @ centred  # S [B]
    values, vectors = np.linalg.eigh(form)
    root = vectors * np.sqrt(np.maximum(values, 0))  # A = root root'
    terms = cosines(indicator, lengths) * cosines(centred[:, None], lengths) @ root  # c_k i_k' root [N, B]
    explained = float(sums @ form @ sums)
    drawn = (_random_sums(terms, np.random.default_rng(seed)) ** 2).sum(axis=1)
    chance = (1 + int(np.count_nonzero(drawn >= explained * (1 - 1e-9)))) / (1 + DRAWS)
    return beyond(explained, float((terms**2).sum()), float(error @ error)), chance


def _random_sums(terms: Float[np.ndarray, "N B"], rng: np.random.Generator) -> Float[np.ndarray, "draws B"]:
    """Draw sum_k s_k terms_k for random signs s_k: the largest terms exactly, the rest from the normal distribution.

    The normal distribution has the covariance of the rest. The sum of a few large terms is bounded and far from
    normal, and a real effect consists of such terms: drawn as normal, they would hide it in a short record.
    """
    size = (terms**2).sum(axis=1)
    order = np.argsort(-size)
    large, small = terms[order[:LARGE]], terms[order[LARGE:]]
    signs = 2.0 * rng.integers(0, 2, (DRAWS, len(large)), dtype=np.int8) - 1
    values, vectors = np.linalg.eigh(small.T @ small)
    spread = vectors * np.sqrt(np.maximum(values, 0))
    return signs @ large + rng.standard_normal((DRAWS, terms.shape[1])) @ spread.T


def by_trend(
    error: Float[np.ndarray, " N"],
    fitted: Float[np.ndarray, " N"],
    added: int,
    removed: int,
    experiment: Int[np.ndarray, " N"],
) -> tuple[float, float]:
    """Compute the share of the squared error that a slow trend explains beyond chance, and the p-value of its F test.

        F = (Q / p) / (tau R / (N - tau q)),   Q = |fitted|^2,   R = |error - fitted|^2

    `fitted` holds means of whole experiments or of stretches of time, or straight lines; p = `added` are its degrees of
    freedom, q = `removed` those and the ones removed before, tau is the correlation time of the residual in samples.
    Surrogates with random signs are as slow as the trend, so that no trend would be significant; the F test compares
    the trend with noise that has the correlation of the residual.
    """
    residual = error - fitted
    # Offsets of experiments are a view of their own; in the residual they would look like correlation.
    residual = residual - means(residual, experiment)
    tau, reach = correlation_time(residual, np.bincount(experiment), removed)
    total, rest = float(error @ error), float(residual @ residual)
    free = len(error) / tau - removed
    if added < 1 or free < 1 or rest <= 0:
        return 0.0, 1.0
    explained, expected = float(fitted @ fitted), rest / free  # expected: of one degree of freedom, by chance
    # tau is an estimate from 2 reach + 1 autocovariances, about as sure as a variance of N / (2 reach + 1) samples.
    chance = f.sf(explained / (added * expected), added, min(free, len(error) / (2 * reach + 1)))
    return beyond(explained, min(added * expected, total), total), float(chance)


def by_experiments(
    error: Float[np.ndarray, " N"], experiment: Int[np.ndarray, " N"], kind: Int[np.ndarray, " E"], about: float
) -> tuple[float, float]:
    """Compute the share that the mean errors of kinds of experiments explain beyond chance, and the p-value.

    `kind` [E] says which kind each experiment is of; the means are taken about the value `about`. The experiments are
    the independent samples of the F test, because each may have an offset of its own.
    """
    count = np.bincount(experiment)  # [E]
    mean = np.bincount(experiment, error) / count  # [E]
    of_kind = (np.bincount(kind, count * mean) / np.bincount(kind, count))[kind]  # [E]
    explained, rest = float(count @ (of_kind - about) ** 2), float(count @ (mean - of_kind) ** 2)
    added, free = max(1, int(kind.max())), len(kind) - int(kind.max()) - 1
    if free < 1 or rest <= 0:
        return 0.0, 1.0
    expected, total = rest / free, float(error @ error)
    return beyond(explained, min(added * expected, total), total), float(
        f.sf(explained / added / expected, added, free)
    )


def by_size(size: Float[np.ndarray, " n"], group: Int[np.ndarray, " n"], seed: int) -> tuple[float, float]:
    """Compute how much more of the squared error some groups hold than their share of the blocks, and the p-value.

        D = sum_g max(0, s_g / s - n_g / n),   s_g the sum of the mean squares `size` of the n_g blocks of group g

    A permutation test: the blocks are distributed anew over the groups.
    """
    permuted = np.random.default_rng(seed).permuted(np.tile(size, (SHUFFLES, 1)), axis=1)
    permuted = np.vstack([size, permuted])  # [1 + SHUFFLES, n], the first as it was measured
    member = (group[:, None] == np.arange(group.max() + 1)).astype(float)  # [n, G]
    excess = np.maximum(0, permuted @ member / size.sum() - member.mean(axis=0)).sum(axis=1)
    chance = np.mean(excess >= excess[0] * (1 - 1e-9))  # including the measured one
    return beyond(float(excess[0]), float(excess[1:].mean()), 1.0), float(chance)


def by_bands(power: Float[np.ndarray, " F"], band: Int[np.ndarray, " F"]) -> tuple[int, float, float]:
    """Find the frequency band with the most power beyond that of white noise: its index, that share, and its p-value.

    In white noise the power of the n_b lines of band b, as a part of all n, is Beta(n_b, n - n_b); the p-value is
    multiplied by the number of bands (Bonferroni).
    """
    lines = np.bincount(band)
    part = np.bincount(band, power) / power.sum()
    share = np.maximum(0, (part - lines / len(band)) / np.maximum(1 - lines / len(band), 1e-9))
    best = int(np.argmax(share))
    free = len(band) - lines[best]
    if free < 1:
        return best, 0.0, 1.0
    chance = min(1.0, np.count_nonzero(lines) * beta.sf(min(part[best], 1.0), lines[best], free))
    return best, float(min(share[best], 1.0)), float(chance)


def cosines(columns: Float[np.ndarray, "N m"], lengths: Sequence[int]) -> Float[np.ndarray, "N m"]:
    """Transform each column by the orthonormal cosine transform, experiment by experiment."""
    parts = np.split(columns, np.cumsum(lengths)[:-1])
    return np.concatenate([np.asarray(dct(part, axis=0, norm="ortho")) for part in parts])


def beyond(explained: float, expected: float, total: float) -> float:
    """Correct a share for what chance explains: (explained - expected) / (total - expected), within 0 and 1."""
    return min(1.0, max(0.0, (explained - expected) / (total - expected))) if total > expected else 0.0
