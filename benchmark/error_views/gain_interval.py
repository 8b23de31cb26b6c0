"""How much smaller one error is than another, with an interval from blocks longer than the errors' memory."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float, Int
from scipy.stats import f as f_distribution
from scipy.stats import t as student

from simgap.error_views.correlation import correlation_time, means

# More blocks hardly narrow an interval; longer ones forgive a memory that was taken for too short (Schmeiser 1982).
BLOCKS = 16
FEW = 8  # experiments
LARGEST_EXPONENT = 200.0  # of e, in a ratio of squared errors


def share_with_interval(
    before: Float[np.ndarray, " N"],
    after: Float[np.ndarray, " N"],
    lengths: Int[np.ndarray, " E"],
    memory: float = math.inf,
) -> tuple[float, float, float]:
    """Compute the gain from the losses (squared errors) of all test samples of E experiments, and its 95 % interval.

        share = 1 - sqrt(mean(after) / mean(before)),   d_t = after_t / mean(after) - before_t / mean(before)
        variance of log(mean(after) / mean(before)) = m / (m - 1) sum_i (sum_{t in i} d_t)^2 / N^2 / (1 - tau / 2 L)

    The logarithm is linear in the losses through d (delta method), and d is summed over the m blocks i of all
    experiments (method of batch means, Schmeiser, Operations Research 30, 1982; Ibragimov and Muller, J. Business &
    Economic Statistics 28, 2010). Blocks are as long as leaves 16 of them, but at least twice the memory tau of d
    within the experiments, or as `block_starts` says. Neighbours of mean length L still share part of their noise,
    which 1 - tau / 2 L (1/2 at least) pays for, exact where the autocorrelation decays exponentially. Student's t has
    sum(w)^2 / sum(w^2) - 1 degrees of freedom with the blocks' shares w of the losses, because an error that sits in
    two of ten blocks is seen twice (Carter, Schnepel and Steigerwald, Review of Economics and Statistics 99, 2017).

    A large gain is believed whatever the scatter of few blocks: see `share_of_few`. `memory` is that of the errors
    themselves, in samples.
    """
    losses = np.stack([before / before.mean(), after / after.mean()])  # [2, N]
    d = losses[1] - losses[0]
    starts, correction = blocks_of(d, lengths)
    m = len(starts)
    variance = m / max(1, m - 1) * np.sum(np.add.reduceat(d, starts) ** 2) / len(d) ** 2 / correction
    w = np.add.reduceat(losses.mean(axis=0), starts)
    freedom = max(1.0, w.sum() ** 2 / np.sum(w**2) - 1)
    reach = student.ppf(0.975, freedom) * math.sqrt(variance) if m > 1 else math.inf
    ratio = math.log(after.mean() / before.mean())
    share, low, high = (1 - math.exp(0.5 * min(ratio + r, LARGEST_EXPONENT)) for r in (0.0, reach, -reach))
    if low <= 0 < share and m > 1:
        low = max(low, least_share(before, after, starts, correction))
    if low <= 0 < share:
        low = max(low, share_of_few(before, after, lengths, memory))
    return share, low, high


def share_of_few(
    before: Float[np.ndarray, " N"], after: Float[np.ndarray, " N"], lengths: Int[np.ndarray, " E"], memory: float
) -> float:
    """Find the gain that is left where chance has made the two errors as unlike as it does in 2.5 of 100 cases.

        1 - sqrt(F mean(after) / mean(before)),   F = F_{0.975}(n_before, n_after),   n = (sum w_i)^2 / sum w_i^2

    The F-test of two variances, with the losses w_i of blocks as long as the memory of the errors in the place of
    single samples (Kish, Survey Sampling, 1965, for their effective number n). No scatter of blocks enters, so a large
    gain is shown by a record of a few memories. Gaussian errors tell twice as much, those in bursts do not.
    """
    starts = block_starts(lengths, memory, least=1)
    n_before, n_after = (np.sum(w) ** 2 / np.sum(w**2) for w in (np.add.reduceat(of, starts) for of in (before, after)))
    return 1 - math.sqrt(after.mean() / before.mean() * f_distribution.ppf(0.975, n_before, n_after))


def blocks_of(d: Float[np.ndarray, " N"], lengths: Int[np.ndarray, " E"]) -> tuple[Int[np.ndarray, " m"], float]:
    """Cut a difference of losses in blocks longer than its memory; return their starts and 1 - tau / 2 L."""
    tau, _ = correlation_time(d - means(d, np.repeat(np.arange(len(lengths)), lengths)), lengths, len(lengths))
    starts = block_starts(lengths, max(2 * tau, len(d) / BLOCKS))
    mean_length = len(d) / len(starts)
    return starts, 1 - min(0.5, 0.5 * tau / mean_length) if len(starts) > len(lengths) else 1.0


def least_share(
    before: Float[np.ndarray, " N"], after: Float[np.ndarray, " N"], starts: Int[np.ndarray, " m"], correction: float
) -> float:
    """Find the smallest gain that the difference of the losses does not reject; no logarithm of a small mean enters.

        t(rho) = (rho mean(before) - mean(after)) / sd of the blocks' mean of (after - rho before)

    Fieller (Supplement to the J. Royal Statistical Society 7, 1940); at rho = 1 the test of Diebold and Mariano (J.
    Business & Economic Statistics 13, 1995). Where a gain is large, what is left sits in few blocks, and the interval
    of the logarithm of its mean then reaches beyond zero though every block gained.
    """
    m = len(starts)
    b, a = (np.add.reduceat(losses / before.mean(), starts) for losses in (before, after))

    def rejected(rho: float) -> bool:
        d, w = rho * b - a, a + rho * b
        centred = d - d.mean()
        freedom = max(1.0, w.sum() ** 2 / np.sum(w**2) - 1)
        deviation = math.sqrt(m / (m - 1) * float(centred @ centred) / correction)
        return bool(d.sum() > student.ppf(0.975, freedom) * deviation)

    if not rejected(1.0):
        return -math.inf
    low, high = float(a.sum() / b.sum()), 1.0
    for _ in range(40):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if rejected(middle) else (middle, high)
    return 1 - math.sqrt(high)


def block_starts(lengths: Int[np.ndarray, " E"], shortest: float, least: int = 2) -> Int[np.ndarray, " m"]:
    """Cut experiments into equal blocks of at least so many samples; one that is shorter stays whole.

    Few experiments are cut in `least` blocks even so: in two, where the scatter of few blocks would hardly be known.
    """
    counts = np.maximum(lengths // shortest, least if len(lengths) < FEW else 1).astype(int)
    counts = np.minimum(counts, lengths)
    ends = np.cumsum(lengths)
    starts = [
        end - length + length * np.arange(count) // count
        for end, length, count in zip(ends, lengths, counts, strict=True)
    ]
    return np.concatenate(starts)
